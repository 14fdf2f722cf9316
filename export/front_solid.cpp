// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/front_solid.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include "core/surface/cubic_spline.h"

namespace lensforge {
namespace {

/// Volume below the upper half of a sphere of radius R around the origin over the rectangle from
/// (0, 0) to (x, y), odd in both: with c = √(R² − x² − y²)
///   xyc/3 + x (3R² − x²)/6 · atan(y/c) + y (3R² − y²)/6 · atan(x/c) − R³/3 · atan(xy/(Rc)).
double below_sphere(double x, double y, double radius) {
  const double r2 = radius * radius;
  const double c = std::sqrt(r2 - x * x - y * y);
  return x * y * c / 3.0 + x * (3.0 * r2 - x * x) / 6.0 * std::atan(y / c) +
         y * (3.0 * r2 - y * y) / 6.0 * std::atan(x / c) -
         r2 * radius / 3.0 * std::atan(x * y / (radius * c));
}

double volume(const SphericalFront& front, const Eigen::AlignedBox2d& box) {
  const double radius = std::abs(front.radius);
  const Eigen::Vector2d low = box.min() - front.apex.head<2>();
  const Eigen::Vector2d high = box.max() - front.apex.head<2>();
  const double below_half =
      below_sphere(high.x(), high.y(), radius) - below_sphere(low.x(), high.y(), radius) -
      below_sphere(high.x(), low.y(), radius) + below_sphere(low.x(), low.y(), radius);
  const double centre = front.apex.z() + front.radius;
  return centre * box.volume() - std::copysign(below_half, front.radius);
}

/// Places along an axis and their weights.
using Rule = std::vector<std::pair<double, double>>;

/// The sum over a rule is the integral of a spline from `from` to `to`: a cubic's integral over a
/// cell is its mean at ±1/√3 of the half cell (Gauss, two points).
/// @param step  between samples. @param samples  outside of them the spline is a cubic, then
/// straight.
Rule gauss_rule(double from, double to, double corner, double step, int samples) {
  std::vector<double> ends{from};
  for (int k = -1; k <= samples; ++k) {
    const double knot = corner + k * step;
    if (knot > from && knot < to) ends.push_back(knot);
  }
  ends.push_back(to);
  Rule rule;
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
    const double half = 0.5 * (ends[k + 1] - ends[k]);
    for (const double side : {-1.0, 1.0}) {
      rule.emplace_back(ends[k] + (1.0 + side / std::numbers::sqrt3) * half, half);
    }
  }
  return rule;
}

double volume(const HeightFront& front, const Eigen::AlignedBox2d& box) {
  const HeightGrid& grid = front.spline->grid();
  const Eigen::Vector2d step =
      front.size.cwiseQuotient(Eigen::Vector2d(grid.columns - 1, grid.rows - 1));
  const auto rule = [&](int axis, int samples) {
    return gauss_rule(box.min()[axis], box.max()[axis], front.corner[axis], step[axis], samples);
  };
  const FrontSurface surface(front);
  const Rule along_x = rule(0, grid.columns);
  double sum = 0.0;
  for (const auto& [y, weight_y] : rule(1, grid.rows)) {
    double line = 0.0;
    for (const auto& [x, weight_x] : along_x) line += weight_x * surface.height({x, y});
    sum += weight_y * line;
  }
  return sum;
}

/// From coefficients c_{−1} … c_n of lines, a line a column, on knots at all whole numbers to those
/// on knots with fourfold ends (Boehm's knot insertion): the value at the end, (2 c_0 + c_1) / 3,
/// c_1, ...
Eigen::MatrixXd clamped(const Eigen::MatrixXd& c) {
  const Eigen::Index last = c.rows() - 1;
  Eigen::MatrixXd result = c;
  result.row(0) = (c.row(0) + 4.0 * c.row(1) + c.row(2)) / 6.0;
  result.row(1) = (2.0 * c.row(1) + c.row(2)) / 3.0;
  result.row(last) = (c.row(last) + 4.0 * c.row(last - 1) + c.row(last - 2)) / 6.0;
  result.row(last - 1) = (2.0 * c.row(last - 1) + c.row(last - 2)) / 3.0;
  return result;
}

}  // namespace

SplinePatch patch_of(const HeightFront& front) {
  const HeightGrid& grid = front.spline->grid();
  SplinePatch patch;
  patch.box = {front.corner, Eigen::Vector2d(front.corner + front.size)};
  patch.cells_u = grid.columns - 1;
  patch.cells_v = grid.rows - 1;
  auto& [x, y, z] = patch.coefficients;
  for (Eigen::MatrixXd* const axis : {&x, &y, &z}) axis->resize(grid.columns + 2, grid.rows + 2);
  const Eigen::Vector2d step = front.size.cwiseQuotient(patch.cells());
  for (int j = 0; j < grid.rows + 2; ++j) {
    for (int i = 0; i < grid.columns + 2; ++i) {
      x(i, j) = front.corner.x() + step.x() * greville_point(i, patch.cells_u);
      y(i, j) = front.corner.y() + step.y() * greville_point(j, patch.cells_v);
      z(i, j) = front.spline->coefficient(i - 1, j - 1);
    }
  }
  z = clamped(clamped(z).transpose()).transpose().eval();
  return patch;
}

double volume_below(const Front& front, const Eigen::AlignedBox2d& box) {
  return std::visit([&box](const auto& one) { return volume(one, box); }, front);
}

}  // namespace lensforge
