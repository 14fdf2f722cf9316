// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"

namespace lensforge {

/// Height and slopes of a surface above a point.
struct SurfacePoint {
  double z = 0.0;                                   ///< mm
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< ∂z/∂x, ∂z/∂y
};

/// A cubic height over a triangle seen from above.
class SmoothPatch {
 public:
  /// Bernstein coefficients over corners 0, 1, 2 in the order 300, 030, 003, 210, 120, 201, 021,
  /// 111, 102, 012.
  using Coefficients = std::array<double, 10>;

  /// @pre the corners do not lie on one line.
  SmoothPatch(const std::array<Eigen::Vector2d, 3>& corners, const Coefficients& coefficients);

  /// True if a point is on the triangle or within rounding of it.
  [[nodiscard]] bool contains(const Eigen::Vector2d& xy) const {
    const Eigen::Vector2d b = to_weights_ * (xy - origin_);
    return b.x() >= -kOnPatch && b.y() >= -kOnPatch && b.x() + b.y() <= 1.0 + kOnPatch;
  }

  /// The cubic at a point, continued beyond the triangle.
  [[nodiscard]] SurfaceShape at(const Eigen::Vector2d& xy) const;

  /// Bounds of the height over the triangle, mm: a cubic stays in the hull of its coefficients.
  [[nodiscard]] double lowest() const { return lowest_; }
  [[nodiscard]] double highest() const { return highest_; }

  /// Barycentric tolerance for points outside the triangle.
  static constexpr double kOnPatch = 1e-9;

 private:
  Eigen::Vector2d origin_;  ///< Corner 0.
  double lowest_;
  double highest_;
  Eigen::Matrix2d to_weights_;  ///< Offset from corner 0 → barycentric weights of corners 1, 2.
  /// Coefficients of 1, x, y, x², xy, y², x³, x²y, xy², y³ relative to the origin.
  std::array<double, 10> power_{};
};

/// Position of a point seen from above: its triangle (−1 if none) and weights there.
struct PlaceOnMesh {
  std::int64_t triangle = -1;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< Barycentric.
};

/// The cubic with these heights and slopes at a triangle's corners and this height in its middle.
SmoothPatch cubic_through(const std::array<Eigen::Vector2d, 3>& corners,
                          const std::array<SurfacePoint, 3>& points, double middle);

/// Finds the triangle of a height field above or below a point.
class TriangleIndex {
 public:
  /// Stores triangle numbers, not the mesh.
  explicit TriangleIndex(const SurfaceMesh& mesh);

  /// @param mesh  the mesh that the index was built for; heights may differ.
  [[nodiscard]] PlaceOnMesh locate(const SurfaceMesh& mesh, const Eigen::Vector2d& xy) const;

  /// Bounding box of the mesh.
  [[nodiscard]] const Eigen::AlignedBox2d& box() const { return box_; }

 private:
  [[nodiscard]] std::int64_t bin_of(const Eigen::Vector2d& xy) const;
  [[nodiscard]] Eigen::Vector2i bin_cell(const Eigen::Vector2d& xy) const;

  Eigen::AlignedBox2d box_;
  Eigen::Vector2i bins_{1, 1};
  /// Triangles that may cover bin b are bin_triangles_[bin_begin_[b] … bin_begin_[b+1]).
  std::vector<std::int64_t> bin_begin_;
  std::vector<std::int32_t> bin_triangles_;
};

/// The normals that direct the light: one per triangle (the paper's model), one per vertex (a
/// polished, smooth part), or those of one C² spline, which is then the surface itself.
enum class SurfaceModel { kFacet, kSmooth, kSpline };

/// All of them, in the order in which files and commands list them.
inline constexpr std::array kSurfaceModels{SurfaceModel::kFacet, SurfaceModel::kSmooth,
                                           SurfaceModel::kSpline};
/// The models that a mesh alone can represent.
inline constexpr std::array kMeshModels{SurfaceModel::kFacet, SurfaceModel::kSmooth};

/// A model's name in files and options.
inline std::string model_name(SurfaceModel model) {
  switch (model) {
    case SurfaceModel::kFacet:
      return "facet";
    case SurfaceModel::kSmooth:
      break;
    case SurfaceModel::kSpline:
      return "spline";
  }
  return "smooth";
}

/// Some models with their names.
template <class Models>
std::vector<std::pair<std::string, SurfaceModel>> named(const Models& some) {
  std::vector<std::pair<std::string, SurfaceModel>> models;
  models.reserve(some.size());
  for (const SurfaceModel model : some) models.emplace_back(model_name(model), model);
  return models;
}

/// Every model with its name.
inline std::vector<std::pair<std::string, SurfaceModel>> named_models() {
  return named(kSurfaceModels);
}

/// The nearest point of a box: rounding may put points of the rim outside.
inline Eigen::Vector2d nearest_inside(const Eigen::AlignedBox2d& box, const Eigen::Vector2d& at) {
  return at.cwiseMax(box.min()).cwiseMin(box.max());
}

/// Least and largest of a surface's second derivatives in any direction, 1/mm.
struct BendRange {
  double least = 0.0;
  double largest = 0.0;

  /// Widens the range to the eigenvalues of second derivatives.
  void include(const Eigen::Matrix2d& bend);
};

/// A lens's optical surface under one of the models: a height field over the triangles of a mesh.
/// Cutting, export and prediction use this interface, not the model's name. A new model implements
/// the virtual functions and is added to optical_surface().
class OpticalSurface {
 public:
  OpticalSurface(const OpticalSurface&) = delete;
  OpticalSurface& operator=(const OpticalSurface&) = delete;
  virtual ~OpticalSurface() = default;

  /// True if slopes may jump from one triangle to the next; if false, they are continuous
  /// everywhere.
  [[nodiscard]] virtual bool has_creases() const = 0;
  /// The point of a triangle with these barycentric weights, none below 0.
  [[nodiscard]] virtual SurfacePoint in_triangle(std::int64_t triangle,
                                                 const Eigen::Vector3d& weights) const = 0;
  /// The cubic around such a point: one per triangle, or one per third of it (has_thirds()), chosen
  /// by the corner of least weight.
  [[nodiscard]] virtual SmoothPatch patch_in(std::int64_t triangle,
                                             const Eigen::Vector3d& weights) const = 0;
  [[nodiscard]] virtual bool has_thirds() const { return false; }
  /// Curvature bounds over a triangle, its border included.
  [[nodiscard]] virtual BendRange bend_range(std::int64_t triangle) const = 0;
  /// Like in_triangle(), with second derivatives where these are continuous; else they are 0.
  [[nodiscard]] virtual SurfaceShape shape_in(std::int64_t triangle,
                                              const Eigen::Vector3d& weights) const {
    const SurfacePoint point = in_triangle(triangle, weights);
    return {point.z, point.slope, Eigen::Matrix2d::Zero()};
  }
  /// in_triangle().z alone, mm, with the same bits.
  [[nodiscard]] virtual double height_in(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const {
    return in_triangle(triangle, weights).z;
  }

  /// The point above xy; nothing outside the mesh.
  [[nodiscard]] std::optional<SurfacePoint> at(const Eigen::Vector2d& xy) const;
  /// The cubic around a point; nothing outside the mesh.
  [[nodiscard]] std::optional<SmoothPatch> patch_at(const Eigen::Vector2d& xy) const;

  /// The mesh, with the surface's heights at the vertices.
  [[nodiscard]] const SurfaceMesh& mesh() const { return mesh_; }
  [[nodiscard]] const Eigen::AlignedBox2d& box() const { return index_.box(); }

 protected:
  /// @pre every triangle faces +z (height_field_fault()).
  explicit OpticalSurface(SurfaceMesh mesh);

  [[nodiscard]] PlaceOnMesh locate(const Eigen::Vector2d& xy) const {
    return index_.locate(mesh_, xy);
  }

 private:
  SurfaceMesh mesh_;
  TriangleIndex index_;
};

/// The surface that a mesh represents under a model. @pre every triangle faces +z; the model is one
/// of kMeshModels.
std::shared_ptr<const OpticalSurface> optical_surface(const SurfaceMesh& mesh, SurfaceModel model);

/// The facets of a mesh as they are (the paper's model): flat triangles between creases.
class FacetSurface final : public OpticalSurface {
 public:
  /// @pre every triangle faces +z (height_field_fault()).
  explicit FacetSurface(const SurfaceMesh& mesh) : OpticalSurface(mesh) {}

  [[nodiscard]] bool has_creases() const override { return true; }
  [[nodiscard]] SurfacePoint in_triangle(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const override;
  [[nodiscard]] SmoothPatch patch_in(std::int64_t triangle,
                                     const Eigen::Vector3d& weights) const override;
  /// Zero: the triangle is flat, and the creases around it do not count.
  [[nodiscard]] BendRange bend_range(std::int64_t /*triangle*/) const override { return {}; }
};

/// A spline as the surface to cut and predict: twice continuously differentiable, exact at every
/// point. Its mesh is spline_nodes() with kMeshSamples.
class SplineSurface final : public OpticalSurface {
 public:
  /// @pre every triangle of the nodes faces +z (spline_fault()).
  explicit SplineSurface(ControlNet net);

  [[nodiscard]] bool has_creases() const override { return false; }
  [[nodiscard]] SurfacePoint in_triangle(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const override;
  /// The cubic with the spline's heights and slopes at the triangle's corners and its height in the
  /// middle. Elsewhere the error is of fourth order in the triangle's size.
  [[nodiscard]] SmoothPatch patch_in(std::int64_t triangle,
                                     const Eigen::Vector3d& weights) const override;
  /// Bounds of the spline at the corners and of the cubic over the whole triangle.
  [[nodiscard]] BendRange bend_range(std::int64_t triangle) const override;

  [[nodiscard]] const ControlNet& net() const { return net_; }

  [[nodiscard]] SurfaceShape shape_in(std::int64_t triangle,
                                      const Eigen::Vector3d& weights) const override;

 private:
  [[nodiscard]] Eigen::Vector2d node_parameters(int node) const;

  ControlNet net_;
};

}  // namespace lensforge
