// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/surface/smooth_patch.h"
#include "core/surface/surface_mesh.h"
#include "core/surface/surface_model.h"
#include "core/surface/triangle_index.h"

namespace lensforge {

/// Height and slopes of a surface above a point.
struct SurfacePoint {
  double z = 0.0;                                   ///< mm
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< ∂z/∂x, ∂z/∂y
};

/// The nearest point of a box: rounding may put points of the rim outside.
inline Eigen::Vector2d nearest_inside(const Eigen::AlignedBox2d& box, const Eigen::Vector2d& at) {
  return at.cwiseMax(box.min()).cwiseMin(box.max());
}

/// Least and largest of a surface's second derivatives in any direction, 1/mm.
struct BendRange {
  double least = 0.0;
  double largest = 0.0;
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

}  // namespace lensforge
