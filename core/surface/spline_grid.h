// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"

/// A tensor product of cubic splines, sampled on a tensor grid.
namespace lensforge {

/// Coefficients of x and y, mm; row index runs along u.
using SplinePlan = std::array<Eigen::MatrixXd, 2>;

/// One direction: its splines at its samples.
struct AxisSamples {
  using Basis = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// @param at  the samples, in cells. @param length  of the whole axis, mm.
  AxisSamples(const std::vector<double>& at, int knot_cells, double length);

  int cells = 0;
  Basis values;  ///< One row per sample.
  Basis slopes;  ///< The same, 1/mm.
};

/// Basis of coefficient vectors in which a direction's sums of squares of values and of slopes are
/// both diagonal.
struct AxisModes {
  explicit AxisModes(const AxisSamples& axis);

  Eigen::MatrixXd modes;      ///< Columns; squares of values sum to 1.
  Eigen::VectorXd stiffness;  ///< Sum of squares of slopes per mode, 1/mm².
};

/// Points and their derivatives by the parameters along a line of samples, 2 × samples.
struct PlanLine {
  Eigen::Matrix2Xd xy, by_u, by_v;

  [[nodiscard]] Eigen::Matrix2d derivative(Eigen::Index j) const;
};

/// Height and its derivatives by the parameters along a line of samples.
struct HeightLine {
  Eigen::VectorXd z, by_u, by_v;
};

/// Samples along both directions.
struct SplineGrid {
  AxisSamples u;
  AxisSamples v;

  /// The line at sample number `i` along u.
  [[nodiscard]] PlanLine plan_line(const SplinePlan& plan, std::int64_t i) const;
  [[nodiscard]] HeightLine height_line(const Eigen::MatrixXd& heights, std::int64_t i) const;

  /// Σ over all samples of (a·∂/∂u + b·∂/∂v + c) of every basis function, where `weigh(i)` returns
  /// a, b and c (columns) along line i. Several threads call it at the same time.
  template <class Weigh>
  [[nodiscard]] Eigen::MatrixXd moments(const Executor& executor, const Weigh& weigh) const {
    Eigen::MatrixXd by_slope(v.values.cols(), u.values.rows());
    Eigen::MatrixXd by_value(v.values.cols(), u.values.rows());
    parallel_for(
        executor, "spline moments", u.values.rows(),
        [&](std::int64_t i) {
          const Eigen::MatrixX3d wanted = weigh(i);
          by_slope.col(i) = v.values.transpose() * wanted.col(0);
          by_value.col(i) =
              v.slopes.transpose() * wanted.col(1) + v.values.transpose() * wanted.col(2);
        },
        1);
    return u.slopes.transpose() * by_slope.transpose() +
           u.values.transpose() * by_value.transpose();
  }
};

}  // namespace lensforge
