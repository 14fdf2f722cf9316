// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/front_solid.h"

#include <cmath>

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

}  // namespace

double volume_below(const SphericalFront& front, const Eigen::AlignedBox2d& box) {
  const double radius = std::abs(front.radius);
  const Eigen::Vector2d low = box.min() - front.apex.head<2>();
  const Eigen::Vector2d high = box.max() - front.apex.head<2>();
  const double below_half =
      below_sphere(high.x(), high.y(), radius) - below_sphere(low.x(), high.y(), radius) -
      below_sphere(high.x(), low.y(), radius) + below_sphere(low.x(), low.y(), radius);
  const double centre = front.apex.z() + front.radius;
  return centre * box.volume() - std::copysign(below_half, front.radius);
}

}  // namespace lensforge
