// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/optimize/grid_preconditioner_on.h"

namespace lensforge {

extern template class GridPreconditionerOn<Executor>;

/// Approximate inverse Hessian on a grid mesh, diagonal under the discrete cosine transform: for
/// the heights (Δ + μ)⁻², since brightness is to first order a second derivative of height; for x
/// and y a weaker smoothing. Symmetric positive definite on the coordinates that may move. On the
/// CPU; GridPreconditionerOn is the same on any executor.
class GridPreconditioner : private GridPreconditionerOn<Executor> {
 public:
  /// @param aspect  cell height ÷ cell width. @param movable  3 × V of ones and zeros.
  GridPreconditioner(const GridShape& shape, double aspect, const Eigen::Matrix3Xd& movable,
                     const Executor& executor)
      : GridPreconditionerOn<Executor>(shape, aspect, movable, executor) {}

  using GridPreconditionerOn<Executor>::xy;
  using GridPreconditionerOn<Executor>::z;

  /// How far each coordinate of each vertex moves beside the others, 3 × V factors > 0, 1 to start
  /// with: a step that suits a large cell would turn a small one over.
  using GridPreconditionerOn<Executor>::set_reach;

  /// r ← P g, or about P^½ g (exact where no coordinate is held and all reach equally far); both
  /// 3 V numbers, x y z of each vertex in turn.
  void apply(const Eigen::VectorXd& g, Eigen::VectorXd& r) { apply_power(g, 1.0, r); }
  void apply_root(const Eigen::VectorXd& g, Eigen::VectorXd& r) { apply_power(g, 0.5, r); }

 private:
  void apply_power(const Eigen::VectorXd& g, double exponent, Eigen::VectorXd& r);
};

}  // namespace lensforge
