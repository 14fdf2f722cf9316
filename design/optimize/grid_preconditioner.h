// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "core/executor.h"
#include "core/surface_mesh.h"
#include "design/optimize/cosine_transform.h"

namespace lensforge {

/// The part of a preconditioner that acts on one coordinate: a function of the grid Laplacian's
/// eigenvalue λ (1/cell², cells of the mesh's columns), all ≥ 0.
struct GridSymbol {
  double scale = 1.0;   ///< s
  double floor = 0.0;   ///< μ
  double power = 2.0;   ///< p
  double growth = 0.0;  ///< γ: the symbol is s / ((μ + λ)^p (1 + γλ)).
  /// The coordinate moves in proportion to this power of set_cell_sizes().
  double size_power = 0.0;
};

/// Approximate inverse Hessian on a grid mesh, diagonal under the discrete cosine transform: for
/// the heights (Δ + μ)⁻², since brightness is to first order a second derivative of height; for x
/// and y a weaker smoothing. Symmetric positive definite on the coordinates that may move.
class GridPreconditioner {
 public:
  /// @param aspect  cell height ÷ cell width. @param movable  3 × V of ones and zeros.
  GridPreconditioner(const GridShape& shape, double aspect, const Eigen::Matrix3Xd& movable,
                     const Executor& executor);

  GridSymbol xy;
  GridSymbol z;

  /// Relative sizes of the cells around every vertex, V factors > 0, 1 to start with: a step that
  /// suits a large cell would turn a small one over.
  void set_cell_sizes(const Eigen::VectorXd& sizes) { sizes_ = sizes; }

  /// r ← P g, or about P^½ g (exact where no coordinate is held and all cells have one size); both
  /// 3 V numbers, x y z of each vertex in turn.
  void apply(const Eigen::VectorXd& g, Eigen::VectorXd& r);
  void apply_root(const Eigen::VectorXd& g, Eigen::VectorXd& r);

 private:
  void apply_power(const Eigen::VectorXd& g, double exponent, Eigen::VectorXd& r);
  void apply_coordinate(const Eigen::VectorXd& g, int k, double exponent, Eigen::VectorXd& r);

  GridShape shape_;
  Eigen::Matrix3Xd movable_;
  Eigen::VectorXd sizes_;
  Executor executor_;
  Eigen::VectorXd eigen_x_;
  Eigen::VectorXd eigen_y_;
  std::array<CosineTransform, 3> transforms_;  ///< One per coordinate.
};

}  // namespace lensforge
