// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// Elements kept as rigid as possible (Liu & Jacobson 2021).
enum class ElementKind {
  kRimSpoke,  ///< A vertex with all edges of its faces: smooth, keeps the shape.
  kFace,      ///< A face with its three edges: lets creases form.
};

struct ShapeUpdateOptions {
  ElementKind elements = ElementKind::kFace;
  double normal_weight = 1000.0;  ///< λ of Eq. 3, times an element's area.
  int max_iterations = 20;        ///< Maximum number of local and global steps.
  /// Ends when no vertex moves by more than this share of the reference's diagonal in one
  /// iteration: 1e-6 is a thousandth of the movement of one update.
  double tolerance = 1e-6;
};

/// Moves vertices so that the faces' normals approach targets while every element of the reference
/// mesh stays as rigid as possible (Tojo et al., Eq. 3):
/// E = Σ_elements [Σ_edges w_ij ‖R e_ij − e′_ij‖² + λ A ‖R n − t‖²] with cotangent weights, in turn
/// over the rotations R (local) and the vertices (global; one factorisation).
class ShapeUpdate {
 public:
  /// @param fixed  one flag per vertex, set for those that do not move. Empty: all move.
  ShapeUpdate(const SurfaceMesh& reference, const std::vector<std::uint8_t>& fixed,
              const ShapeUpdateOptions& options);
  ~ShapeUpdate();
  ShapeUpdate(ShapeUpdate&&) noexcept;
  ShapeUpdate& operator=(ShapeUpdate&&) noexcept;

  /// @param vertices  the start, 3 × V; fixed vertices stay there, and every piece without fixed
  ///                  vertices keeps its mean.
  /// @param targets   unit normals of the faces, 3 × F. @throw Interrupted
  [[nodiscard]] Eigen::Matrix3Xd moved(const Eigen::Matrix3Xd& vertices,
                                       const Eigen::Matrix3Xd& targets,
                                       const Executor& executor) const;

  /// Eq. 3 at `vertices` with the best rotations.
  [[nodiscard]] double energy(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xd& targets,
                              const Executor& executor) const;

 private:
  struct System;
  std::unique_ptr<System> system_;
};

/// Constraints on a new shape, in the units of its mesh.
struct ConstraintSet {
  std::vector<std::uint8_t> fixed;       ///< One flag per vertex.
  std::vector<int> partner;              ///< Mirror image of every vertex; empty: no symmetry.
  int axis = 0;                          ///< Axis of the symmetry, about the box's middle.
  std::vector<std::vector<int>> planar;  ///< Groups of faces that each stay in one plane.
  bool volume = false;                   ///< The closed mesh keeps its volume.
  bool box = false;                      ///< Nothing leaves the bounding box.
  double max_displacement = 0.0;         ///< Limit for a vertex; 0: none.
  double min_thickness = 0.0;            ///< Minimum material behind a vertex; 0: none.

  [[nodiscard]] bool empty() const {
    return partner.empty() && planar.empty() && !volume && !box && max_displacement == 0.0 &&
           min_thickness == 0.0;
  }
};

/// Moves the vertices of a deformed mesh back to positions that its constraints allow.
class Constraints {
 public:
  /// @param reference  the mesh before it moved.
  Constraints(SurfaceMesh reference, ConstraintSet set, const Executor& executor);

  /// Returns nearby vertices that meet the constraints: each constraint is enforced in turn,
  /// several times, the limits (displacement, box) last.
  [[nodiscard]] Eigen::Matrix3Xd enforced(const Eigen::Matrix3Xd& vertices) const;

  /// Broken constraints of a shape, in words; empty if there are none. Tolerances: thickness and
  /// volume 1 %, planes 1e-3 of the diagonal, 1 % of the area turned over.
  [[nodiscard]] std::vector<std::string> broken(const Eigen::Matrix3Xd& vertices) const;

 private:
  [[nodiscard]] SurfaceMesh with(const Eigen::Matrix3Xd& vertices) const;
  [[nodiscard]] Eigen::VectorXd thickness(const Eigen::Matrix3Xd& vertices) const;
  void flatten(Eigen::Matrix3Xd& vertices) const;
  void thicken(Eigen::Matrix3Xd& vertices) const;
  void keep_volume(Eigen::Matrix3Xd& vertices) const;
  void mirror(Eigen::Matrix3Xd& vertices) const;
  void cut_off(Eigen::Matrix3Xd& vertices) const;
  void keep_fixed(Eigen::Matrix3Xd& vertices) const;

  SurfaceMesh reference_;
  ConstraintSet set_;
  Executor executor_;
  double volume_ = 0.0;
  double diagonal_ = 0.0;
  Eigen::Vector3d low_;
  Eigen::Vector3d high_;
  Eigen::VectorXd wanted_thickness_;  ///< The limit, or less if the reference has less.
  std::vector<std::vector<int>> planar_vertices_;
};

}  // namespace lensforge::reflect
