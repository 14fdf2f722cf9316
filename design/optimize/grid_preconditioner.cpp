// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/grid_preconditioner.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lensforge {

namespace {

/// Eigenvalues of the second difference with mirrored ends.
Eigen::VectorXd second_difference_eigenvalues(int n, double spacing) {
  Eigen::VectorXd values(n);
  for (int k = 0; k < n; ++k) values[k] = CosineTransform::eigenvalue(k, n, spacing);
  return values;
}

/// √ of the end weights ½, 1, …, 1, ½ in which the cosine transform of this kind is orthogonal.
double root_end_weight(int i, int n) {
  return i == 0 || i == n - 1 ? std::numbers::sqrt2 / 2.0 : 1.0;
}

}  // namespace

GridPreconditioner::GridPreconditioner(const GridShape& shape, double aspect,
                                       const Eigen::Matrix3Xd& movable, const Executor& executor)
    : shape_(shape),
      movable_(movable),
      sizes_(Eigen::VectorXd::Ones(movable.cols())),
      executor_(executor),
      eigen_x_(second_difference_eigenvalues(shape.columns, 1.0)),
      eigen_y_(second_difference_eigenvalues(shape.rows, aspect)),
      transforms_{CosineTransform(shape.columns, shape.rows),
                  CosineTransform(shape.columns, shape.rows),
                  CosineTransform(shape.columns, shape.rows)} {}

void GridPreconditioner::apply_coordinate(const Eigen::VectorXd& g, int k, double exponent,
                                          Eigen::VectorXd& r) {
  CosineTransform& transform = transforms_[static_cast<std::size_t>(k)];
  double* data = transform.values().data();
  const GridSymbol& symbol = k == 2 ? z : xy;
  const int columns = shape_.columns;
  const int rows = shape_.rows;
  const double normalize = std::pow(symbol.scale, exponent) * transform.inverse_scale();
  const auto freedom = [&](Eigen::Index v) {
    return movable_(k, v) * std::pow(sizes_[v], symbol.size_power * exponent);
  };
  const auto each = [&](const auto& body) {
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        body(static_cast<Eigen::Index>(row) * columns + column, column, row,
             root_end_weight(column, columns) * root_end_weight(row, rows));
      }
    }
  };
  each([&](Eigen::Index v, int, int, double weight) {
    data[v] = freedom(v) * g[3 * v + k] / weight;
  });
  transform.run();
  const double power = -symbol.power * exponent;
  each([&](Eigen::Index v, int column, int row, double) {
    const double lambda = eigen_x_[column] + eigen_y_[row];
    const double base = symbol.floor + lambda;
    const double decay = power == -2.0 ? 1.0 / (base * base) : std::pow(base, power);
    data[v] *= normalize * decay * std::pow(1.0 + symbol.growth * lambda, -exponent);
  });
  transform.run();
  each([&](Eigen::Index v, int, int, double weight) {
    r[3 * v + k] = freedom(v) * data[v] * weight;
  });
}

void GridPreconditioner::apply_power(const Eigen::VectorXd& g, double exponent,
                                     Eigen::VectorXd& r) {
  r.resize(g.size());
  parallel_for(
      executor_, "precondition", 3,
      [&](std::int64_t k) { apply_coordinate(g, static_cast<int>(k), exponent, r); }, 1);
}

void GridPreconditioner::apply(const Eigen::VectorXd& g, Eigen::VectorXd& r) {
  apply_power(g, 1.0, r);
}

void GridPreconditioner::apply_root(const Eigen::VectorXd& g, Eigen::VectorXd& r) {
  apply_power(g, 0.5, r);
}

}  // namespace lensforge
