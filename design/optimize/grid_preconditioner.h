// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"
#include "design/optimize/cosine_transform.h"

namespace lensforge {

/// A preconditioner's factor for one coordinate, a function of the grid Laplacian's eigenvalue λ
/// (1/cell², cells of the mesh's columns). All parameters are ≥ 0.
struct GridSymbol {
  double scale = 1.0;   ///< s
  double floor = 0.0;   ///< μ
  double power = 2.0;   ///< p
  double growth = 0.0;  ///< γ: the symbol is s / ((μ + λ)^p (1 + γλ)).
};

/// Arguments of the preconditioner's kernels: raw arrays in the memory of an executor. The planes
/// hold one coordinate each, row by row, in the basis in which the transform is orthogonal.
struct PreconditionerView {
  int columns;
  int rows;
  const double* movable;  ///< 3 × V
  const double* reach;    ///< 3 × V
  const double* eigen_x;  ///< Eigenvalues of the second differences along a row.
  const double* eigen_y;
  GridSymbol symbols[3];  ///< Of x, y and z.
  double exponent;        ///< Power of the preconditioner to apply.
  double* planes[3];
  std::int64_t first_row = 0;  ///< First row in the arrays, if they hold a part of the grid.

  [[nodiscard]] LF_HD int row(std::int64_t v) const {
    return static_cast<int>(first_row) + static_cast<int>(v) / columns;
  }
  [[nodiscard]] LF_HD int column(std::int64_t v) const { return static_cast<int>(v) % columns; }

  /// √ of the end weights ½, 1, …, 1, ½ in which the cosine transform is orthogonal.
  [[nodiscard]] LF_HD static double root_end_weight(int i, int n) {
    return i == 0 || i == n - 1 ? std::numbers::sqrt2 / 2.0 : 1.0;
  }
  [[nodiscard]] LF_HD double weight(std::int64_t v) const {
    return root_end_weight(column(v), columns) * root_end_weight(row(v), rows);
  }
  /// Factor on coordinate k of a vertex, 0 if it is held.
  [[nodiscard]] LF_HD double freedom(std::int64_t v, int k) const {
    const double far = reach[3 * v + k];
    return movable[3 * v + k] * (exponent == 1.0 ? far : std::pow(far, exponent));
  }
};

/// Gradient of a vertex → planes.
struct EnterPlanes {
  PreconditionerView p;
  const double* g;

  LF_HD void operator()(std::int64_t v) const {
    for (int k = 0; k < 3; ++k) p.planes[k][v] = p.freedom(v, k) * g[3 * v + k] / p.weight(v);
  }
};

/// Multiplies a coefficient of every transformed plane by its symbol.
struct ScaleCoefficient {
  PreconditionerView p;
  double normalize[3];  ///< s^exponent, and the scale of the transform and its inverse.

  LF_HD void operator()(std::int64_t v) const {
    const double lambda = p.eigen_x[p.column(v)] + p.eigen_y[p.row(v)];
    for (int k = 0; k < 3; ++k) {
      const GridSymbol& symbol = p.symbols[k];
      const double decay = inverse_power(symbol.floor + lambda, symbol.power * p.exponent);
      const double growth = inverse_power(1.0 + symbol.growth * lambda, p.exponent);
      p.planes[k][v] *= normalize[k] * decay * growth;
    }
  }

 private:
  /// base^−power. Common powers avoid std::pow(), which takes 5 % of an iteration.
  LF_HD static double inverse_power(double base, double power) {
    if (base == 1.0) return 1.0;
    if (power == 1.0) return 1.0 / base;
    return power == 2.0 ? 1.0 / (base * base) : std::pow(base, -power);
  }
};

/// Planes → step of a vertex.
struct LeavePlanes {
  PreconditionerView p;
  double* r;

  LF_HD void operator()(std::int64_t v) const {
    for (int k = 0; k < 3; ++k) r[3 * v + k] = p.freedom(v, k) * p.planes[k][v] * p.weight(v);
  }
};

/// Approximate inverse Hessian P on a grid mesh, diagonal under the discrete cosine transform: for
/// the heights (Δ + μ)⁻², since brightness is to first order a second derivative of height; for x
/// and y a weaker smoothing. Symmetric positive definite on the coordinates that may move. Vectors
/// have 3 V numbers, x y z of each vertex in turn, in the executor's memory.
template <class Exec>
class GridPreconditionerOn {
 public:
  /// @param aspect  cell height ÷ cell width. @param movable  3 × V of ones and zeros.
  GridPreconditionerOn(const GridShape& shape, double aspect, const Eigen::Matrix3Xd& movable,
                       const Exec& executor)
      : shape_(shape),
        executor_(executor),
        movable_(buffer_of(
            executor,
            std::span<const double>(movable.data(), static_cast<std::size_t>(movable.size())))),
        reach_(static_cast<std::size_t>(movable.size())),
        eigen_x_(eigenvalues(shape.columns, 1.0, executor)),
        eigen_y_(eigenvalues(shape.rows, aspect, executor)),
        transforms_(shape.columns, shape.rows, executor) {
    set_reach(Eigen::Matrix3Xd::Ones(3, movable.cols()));
  }

  GridSymbol xy;
  GridSymbol z;

  /// Relative step of each coordinate of each vertex, 3 × V factors > 0, initially 1: a step that
  /// suits a large cell turns a small one over. In the caller's memory.
  void set_reach(const Eigen::Matrix3Xd& reach) {
    upload(executor_, std::span<const double>(reach.data(), reach_.size()),
           std::span<double>(reach_.data(), reach_.size()));
  }

  /// Coordinates that may move, 3 × V of 1 and 0, from the caller's memory.
  void set_movable(const Eigen::Matrix3Xd& movable) {
    upload(executor_, std::span<const double>(movable.data(), movable_.size()),
           std::span<double>(movable_.data(), movable_.size()));
  }

  /// r ← P^exponent g; for an exponent other than 1 it is exact only if no coordinate is held and
  /// all factors of set_reach() are equal.
  void apply(std::span<const double> g, double exponent, std::span<double> r) {
    const PreconditionerView p = view(exponent);
    const std::int64_t vertices = static_cast<std::int64_t>(reach_.size() / 3);
    parallel_for(executor_, "enter planes", vertices, EnterPlanes{p, g.data()});
    transforms_.run();
    const double scale_xy = std::pow(xy.scale, exponent) * inverse_scale();
    const double scale_z = std::pow(z.scale, exponent) * inverse_scale();
    parallel_for(executor_, "scale coefficients", vertices,
                 ScaleCoefficient{p, {scale_xy, scale_xy, scale_z}});
    transforms_.run();
    parallel_for(executor_, "leave planes", vertices, LeavePlanes{p, r.data()});
  }

 private:
  using Vector = typename Exec::template Buffer<double>;

  static Vector eigenvalues(int n, double spacing, const Exec& executor) {
    const std::vector<double> values = CosineTransform::eigenvalues(n, spacing);
    return buffer_of(executor, std::span<const double>(values));
  }
  /// Scale of a transform and its inverse.
  [[nodiscard]] double inverse_scale() const {
    return 1.0 / (4.0 * (shape_.columns - 1.0) * (shape_.rows - 1.0));
  }
  [[nodiscard]] PreconditionerView view(double exponent) {
    return {shape_.columns,
            shape_.rows,
            movable_.data(),
            reach_.data(),
            eigen_x_.data(),
            eigen_y_.data(),
            {xy, xy, z},
            exponent,
            {transforms_.plane(0), transforms_.plane(1), transforms_.plane(2)}};
  }

  GridShape shape_;
  Exec executor_;
  Vector movable_;
  Vector reach_;
  Vector eigen_x_;
  Vector eigen_y_;
  GridTransforms<Exec> transforms_;
};

extern template class GridPreconditionerOn<Executor>;

/// Vertices on each side over which levelling_factors() averages. With a radius of 1 the means
/// follow the probes' noise (128² portrait, facets, MAE after 600 iterations: 0.0030; with 2 to 8:
/// 0.0021 to 0.0024).
inline constexpr int kLevellingRadius = 6;

/// Maximum of the factors and of their inverses.
inline constexpr double kMaxLevelling = 3.0;

/// Factors on the vertices' reach (GridPreconditionerOn::set_reach()) that make the preconditioned
/// curvature about the same everywhere on a grid. Reach enters that curvature squared.
/// @param squares  V squares, ≥ 0, of preconditioned curvatures from random probes. They are
///                 averaged over (2 kLevellingRadius + 1)² vertices, fewer at the border.
/// @return V factors around 1.
Eigen::ArrayXd levelling_factors(const Eigen::VectorXd& squares, const GridShape& shape);

}  // namespace lensforge
