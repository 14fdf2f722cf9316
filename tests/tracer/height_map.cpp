// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracer/height_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace tracer {
namespace {

/// What takes a line's samples to its values and slopes at the samples and one beyond each end.
struct Line {
  Eigen::MatrixXd values;
  Eigen::MatrixXd slopes;
};

/// Slopes s of a spline through samples f: equal second derivatives on both sides of a sample,
/// s₋ + 4 s + s₊ = 3 (f₊ − f₋), and equal third ones at the last but one from each end. A piece has
/// 2 f₀ − 2 f₁ + s₀ + s₁ for a sixth of its third derivative.
Eigen::MatrixXd slopes_of(Eigen::Index n) {
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 1; i < n - 1; ++i) {
    left.block(i, i - 1, 1, 3) << 1.0, 4.0, 1.0;
    right.block(i, i - 1, 1, 3) << -3.0, 0.0, 3.0;
  }
  left.block(0, 0, 1, 3) << 1.0, 0.0, -1.0;
  right.block(0, 0, 1, 3) << -2.0, 4.0, -2.0;
  left.block(n - 1, n - 3, 1, 3) << 1.0, 0.0, -1.0;
  right.block(n - 1, n - 3, 1, 3) << -2.0, 4.0, -2.0;
  return left.fullPivLu().solve(right);
}

/// Beyond an end the second derivative m falls to 0 within one sample's distance: the slope there
/// is s + m/2, the value f + s + m/3, all counted outwards.
Line line_of(Eigen::Index n) {
  const Eigen::MatrixXd value = Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd slope = slopes_of(n);
  Line line{Eigen::MatrixXd(n + 2, n), Eigen::MatrixXd(n + 2, n)};
  line.values.middleRows(1, n) = value;
  line.slopes.middleRows(1, n) = slope;
  const auto extend = [&](Eigen::Index end, Eigen::Index inside, Eigen::Index beyond, double out) {
    const Eigen::RowVectorXd s = out * slope.row(end);
    const Eigen::RowVectorXd m =
        6.0 * (value.row(inside) - value.row(end)) + 4.0 * s + 2.0 * out * slope.row(inside);
    line.values.row(beyond) = value.row(end) + s + m / 3.0;
    line.slopes.row(beyond) = out * (s + m / 2.0);
  };
  extend(0, 1, 0, -1.0);
  extend(n - 1, n - 2, n + 1, 1.0);
  return line;
}

/// Weights of two neighbours' values and slopes at a place between them, and their derivatives.
struct Hermite {
  Eigen::Index first;
  double value[2], slope[2];        ///< Of a piece's value.
  double by_value[2], by_slope[2];  ///< Of its derivative.

  /// @param t  place in samples from the one beyond the edge; straight on beyond both ends.
  Hermite(double t, Eigen::Index count) {
    const double inside = std::clamp(t, 0.0, static_cast<double>(count - 1));
    first = std::min(static_cast<Eigen::Index>(inside), count - 2);
    const double u = inside - static_cast<double>(first);
    const double v = 1.0 - u;
    value[0] = v * v * (1.0 + 2.0 * u);
    value[1] = u * u * (1.0 + 2.0 * v);
    slope[0] = u * v * v;
    slope[1] = -u * u * v;
    by_value[0] = -6.0 * u * v;
    by_value[1] = 6.0 * u * v;
    by_slope[0] = v * (v - 2.0 * u);
    by_slope[1] = u * (u - 2.0 * v);
    for (int k = 0; k < 2; ++k) {
      value[k] += (t - inside) * by_value[k];
      slope[k] += (t - inside) * by_slope[k];
    }
  }
};

}  // namespace

HeightMap::HeightMap(const Picture& samples, const Vec2& size)
    : step_(size.x() / (samples.columns - 1), size.y() / (samples.rows - 1)) {
  Eigen::MatrixXd f(samples.columns, samples.rows);
  for (int row = 0; row < samples.rows; ++row) {
    for (int column = 0; column < samples.columns; ++column) {
      f(column, samples.rows - 1 - row) =
          samples.light[static_cast<std::size_t>(row * samples.columns + column)];
    }
  }
  const Line x = line_of(samples.columns);
  const Line y = line_of(samples.rows);
  z_ = x.values * f * y.values.transpose();
  by_x_ = x.slopes * f * y.values.transpose();
  by_y_ = x.values * f * y.slopes.transpose();
  by_xy_ = x.slopes * f * y.slopes.transpose();
}

HeightMap::Point HeightMap::at(const Vec2& place) const {
  const Hermite u(place.x() / step_.x() + 1.0, z_.rows());
  const Hermite v(place.y() / step_.y() + 1.0, z_.cols());
  Point point{0.0, Vec2::Zero()};
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const Eigen::Index a = u.first + i;
      const Eigen::Index b = v.first + j;
      const double along = u.value[i] * z_(a, b) + u.slope[i] * by_x_(a, b);
      const double along_twisted = u.value[i] * by_y_(a, b) + u.slope[i] * by_xy_(a, b);
      const double tilt = u.by_value[i] * z_(a, b) + u.by_slope[i] * by_x_(a, b);
      const double tilt_twisted = u.by_value[i] * by_y_(a, b) + u.by_slope[i] * by_xy_(a, b);
      point.z += v.value[j] * along + v.slope[j] * along_twisted;
      point.slope.x() += (v.value[j] * tilt + v.slope[j] * tilt_twisted) / step_.x();
      point.slope.y() += (v.by_value[j] * along + v.by_slope[j] * along_twisted) / step_.y();
    }
  }
  return point;
}

}  // namespace tracer
