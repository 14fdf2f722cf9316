// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"

namespace lensforge {

/// Valleys of an even spline that are sharper than a ball: second differences of neighbouring
/// control points along the grid's lines and diagonals, which bound the second derivatives of the
/// spline, in units of the sharpest allowed.
struct BallNet {
  const double* points;  ///< 3 × control points, row by row.
  std::int64_t columns;
  std::int64_t rows;
  double cell_x;    ///< Knot cell, mm.
  double cell_y;    ///< mm
  double sharpest;  ///< Second derivative that is allowed, 1/mm, > 0.

  /// Steps of the four directions: (1, 0), (0, 1), (1, 1), (1, −1).
  LF_HD static int step_x(int direction) { return direction == 1 ? 0 : 1; }
  LF_HD static int step_y(int direction) {
    if (direction == 0) return 0;
    return direction == 3 ? -1 : 1;
  }

  [[nodiscard]] LF_HD double height(std::int64_t i, std::int64_t j) const {
    return points[3 * (j * columns + i) + 2];
  }
  /// Second differences become second derivatives in units of `sharpest`.
  [[nodiscard]] LF_HD double scale(int direction) const {
    const double x = step_x(direction) * cell_x;
    const double y = step_y(direction) * cell_y;
    return 1.0 / ((x * x + y * y) * sharpest);
  }
  /// By how much a valley is too sharp, ≥ 0; none beside the rim, where knots
  /// are not even.
  [[nodiscard]] LF_HD double excess(std::int64_t i, std::int64_t j, int direction) const {
    const int di = step_x(direction);
    const int dj = step_y(direction);
    if (i < 2 || i > columns - 3 || j < 2 || j > rows - 3) return 0.0;
    const double bend = height(i + di, j + dj) - 2.0 * height(i, j) + height(i - di, j - dj);
    const double over = bend * scale(direction) - 1.0;
    return over > 0.0 ? over : 0.0;
  }
};

/// E_ball of one control point: Σ excess² over the four directions.
struct BallEnergy {
  BallNet net;

  LF_HD std::array<double, 1> operator()(std::int64_t v) const {
    double sum = 0.0;
    for (int d = 0; d < 4; ++d) {
      const double over = net.excess(v % net.columns, v / net.columns, d);
      sum += over * over;
    }
    return {sum};
  }
};

/// Adds weight × ∂E_ball/∂z of one control point.
struct BallGradient {
  BallNet net;
  double weight;
  double* gradient;

  LF_HD void operator()(std::int64_t v) const {
    const std::int64_t i = v % net.columns;
    const std::int64_t j = v / net.columns;
    double sum = 0.0;
    for (int d = 0; d < 4; ++d) {
      const int di = BallNet::step_x(d);
      const int dj = BallNet::step_y(d);
      sum += 2.0 * net.scale(d) *
             (net.excess(i - di, j - dj, d) - 2.0 * net.excess(i, j, d) +
              net.excess(i + di, j + dj, d));
    }
    gradient[3 * v + 2] += weight * sum;
  }
};

/// E_ball; adds weight × derivative to the z of `gradient` (3 × control points).
template <class Exec>
double ball_term(const Exec& executor, const BallNet& net, double weight, double* gradient) {
  const std::int64_t count = net.columns * net.rows;
  const auto value = pending_sum<1>(executor, "ball term", count, BallEnergy{net});
  parallel_for(executor, "ball gradient", count, BallGradient{net, weight, gradient});
  return value.get()[0];
}

}  // namespace lensforge
