// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// What is kept as rigid as possible (Liu & Jacobson 2021).
enum class ElementKind {
  kRimSpoke,  ///< A vertex with all edges of its faces: smooth, holds the shape.
  kFace,      ///< A face with its three edges: lets creases form.
};

struct ShapeUpdateOptions {
  ElementKind elements = ElementKind::kFace;
  double normal_weight = 1000.0;  ///< λ of Eq. 3, times an element's area.
  int max_iterations = 20;        ///< Local and global steps.
  /// Ends when no vertex moved by more than this share of the reference's diagonal in one
  /// iteration: 1e-6 is a thousandth of what one update moves them by.
  double tolerance = 1e-6;
};

/// Moves vertices so that the faces' normals approach targets while every element of the reference
/// mesh stays as rigid as possible (Tojo et al., Eq. 3):
/// E = Σ_elements [Σ_edges w_ij ‖R e_ij − e′_ij‖² + λ A ‖R n − t‖²] with cotangent weights, in turn
/// over the rotations R (local) and the vertices (global; one factorisation).
class ShapeUpdate {
 public:
  /// @param fixed  one flag per vertex: those that do not move. Empty: all move.
  ShapeUpdate(const SurfaceMesh& reference, const std::vector<std::uint8_t>& fixed,
              const ShapeUpdateOptions& options);
  ~ShapeUpdate();
  ShapeUpdate(ShapeUpdate&&) noexcept;
  ShapeUpdate& operator=(ShapeUpdate&&) noexcept;

  /// @param vertices  where the vertices are, 3 × V: the start; fixed ones stay there, and every
  ///                  piece without fixed vertices keeps its mean.
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

}  // namespace lensforge::reflect
