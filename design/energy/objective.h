// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "core/executor.h"
#include "core/image.h"
#include "core/mesh_topology.h"
#include "core/optical_setup.h"
#include "core/surface_mesh.h"
#include "design/energy/area_barrier.h"
#include "design/energy/correspondence_term.h"
#include "design/energy/face_frame.h"
#include "design/energy/weights.h"
#include "design/energy/weingarten.h"
#include "design/flux/flux_image.h"
#include "design/optics/projection.h"

namespace lensforge {

/// The area that a lens's outline keeps for itself: which thresholds its area barrier has.
/// ε1 = 0.1 % and ε2 = 0.5 % of the mean projected triangle: dark parts need small facets (a
/// facet's flux is its projected area), and a thousandth still divides without loss of digits.
AreaBarrier default_area_barrier(const OpticalSetup& setup, std::int64_t triangles);

struct ObjectiveOptions {
  ObjectiveWeights weights;
  SurfaceModel model = SurfaceModel::kFacet;
  double nu = 1.0;               ///< ν of the Welsch function, 1/mm, > 0.
  AreaBarrier area{1e-6, 5e-6};  ///< mm²
};

/// What a surface is shaped after: a picture in linear light (Sun et al., Eq. 18), or where
/// transport wants the light of each face (Eq. 20).
using DesignGoal = std::variant<Image, Correspondence>;

/// The function that both halves of the alternation minimise, of the vertex positions alone: Sun et
/// al., Eq. 18 for a picture, Eq. 20 for a correspondence.
///
/// The Weingarten maps are eliminated. Ψ_ν is concave in h, so that at a given surface E_edge has a
/// majorant linear in h, Σ Ψ(h⁰) + w (h − h⁰) with w = Ψ'(h⁰), tight at h⁰; with w held, every
/// face's best map is a 3 × 3 least-squares solution, and by the envelope theorem the gradient by
/// the vertices is the partial one. relinearize() moves h⁰ to a new surface; between two calls
/// the objective is one smooth function, never less than the paper's.
///
/// Lengths count in pixels in E_bdr and E_lap (the paper's unit); E_face and E_edge have none.
class DesignObjective {
 public:
  /// @param mesh  gives the connectivity; its vertices are where relinearize() is first called.
  /// @param goal  a picture has setup.pixels and is not all black.
  DesignObjective(const SurfaceMesh& mesh, const OpticalSetup& setup, const DesignGoal& goal,
                  const ObjectiveOptions& options, const Executor& executor);

  struct Evaluation {
    bool feasible = false;  ///< False where a barrier is infinite; nothing else is set then.
    EnergyValues energy;
    double mae = 0.0;  ///< Mean |g − g̃|, display-encoded, not clipped; 0 for a correspondence.
  };

  /// Takes the Welsch weights from this surface.
  void relinearize(const Eigen::Matrix3Xd& vertices);

  /// Value and gradient (3 × V, per mm; zero for coordinates that are held: x on the lens's left
  /// and right border, y on the lower and upper one). Same bits for any number of threads.
  Evaluation evaluate(const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xd& gradient);

  /// 1 where a coordinate may move, 0 where it is held; 3 × V.
  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return movable_; }

 private:
  [[nodiscard]] Corners corners(const Eigen::Matrix3Xd& vertices, std::int64_t face) const;
  [[nodiscard]] double measure_faces(const Eigen::Matrix3Xd& vertices);
  void fit_maps(const Eigen::Matrix3Xd& vertices);
  [[nodiscard]] double edge_mismatch(std::int64_t face, int k) const;
  [[nodiscard]] bool land_vertices(const Eigen::Matrix3Xd& vertices);
  [[nodiscard]] ImageTriangle image_triangle(const Eigen::Matrix3Xd& vertices,
                                             std::int64_t face) const;
  void compare_picture(std::span<const double> flux, Evaluation& result);
  struct GoalValues {
    double boundary = 0.0;
    CorrespondenceValues correspondence;
  };
  [[nodiscard]] GoalValues pull_back_vertices(const Eigen::Matrix3Xd& vertices);
  [[nodiscard]] GoalValues pull_back_faces(const Eigen::Matrix3Xd& vertices, EnergyValues& energy);
  /// Derivatives by what a face is made of; summed up and carried to its corners at the end.
  struct FaceBar {
    Corners corners;
    FaceFrame frame;
    Eigen::Vector3d area_normal{0.0, 0.0, 0.0};
  };
  struct Smoothness {
    double face = 0.0;
    double edge = 0.0;
  };
  GoalValues goal_adjoint(std::int64_t face, const ImageTriangle& image, ImageTriangle& bar) const;
  GoalValues image_adjoint(std::int64_t face, const Corners& t, FaceBar& bar) const;
  double barrier_adjoint(std::int64_t face, const Corners& t, FaceBar& bar) const;
  Smoothness smoothness_adjoint(std::int64_t face, double doubled_area, FaceBar& bar) const;
  void gather_vertices(Eigen::Matrix3Xd& gradient);

  Executor executor_;
  ObjectiveOptions options_;
  Projection optics_;
  double lens_area_;
  Eigen::Matrix3Xi triangles_;
  MeshTopology topology_;
  Eigen::Matrix3Xd movable_;
  std::optional<Correspondence> correspondence_;  ///< None if the goal is a picture.
  std::vector<double> target_;                    ///< Display-encoded.
  double target_total_ = 0.0;                     ///< G̃ of Sun et al., Eq. 2.

  std::vector<FaceFrame> frames_;
  std::vector<WeingartenMap> maps_;
  Eigen::Matrix3Xd edge_weights_;  ///< Ψ'(h⁰) of a face's three edges; 0 on the boundary.
  double edge_offset_ = 0.0;       ///< Σ Ψ(h⁰) − w h⁰ over the edges.

  FluxImage flux_;
  FluxCotangentImage cotangent_;
  std::vector<double> error_;
  std::vector<Corners> corner_bar_;

  // Smooth model only.
  Eigen::Matrix3Xd vertex_normals_;  ///< Sums of area normals.
  Eigen::Matrix2Xd landing_;         ///< Pixel coordinates.
  std::vector<ImageTriangle> triangle_bar_;
  Eigen::Matrix3Xd vertex_bar_;         ///< Direct derivative by position.
  Eigen::Matrix3Xd vertex_normal_bar_;  ///< Derivative by the sum of area normals.
};

}  // namespace lensforge
