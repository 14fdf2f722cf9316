// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/outline.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/surface/corners.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Chords of a full circle: chords are π²/2n² of the radius from the arc.
constexpr int kChords = 1440;

using Polygon = std::vector<Eigen::Vector2d>;

/// Adds the corners of a quarter of a circle, from angle `quarter` · 90° on.
void add_quarter(const Eigen::Vector2d& centre, double radius, int quarter, Polygon& points) {
  for (int k = 0; k <= kChords / 4; ++k) {
    const double angle = 2.0 * std::numbers::pi * (quarter * (kChords / 4) + k) / kChords;
    points.emplace_back(centre.x() + radius * std::cos(angle),
                        centre.y() + radius * std::sin(angle));
  }
}

/// The polygon without consecutive equal corners.
Polygon without_repeats(Polygon points) {
  points.erase(std::unique(points.begin(), points.end()), points.end());
  while (points.size() > 1 && points.front() == points.back()) points.pop_back();
  return points;
}

/// Side of a → b on which a point lies: −1, 0 or 1.
int side(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  const double s = cross(b - a, p - a);
  return s > 0.0 ? 1 : (s < 0.0 ? -1 : 0);
}

/// True if p, which lies on the line through a and b, lies between them.
bool between(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  return (p.array() >= a.cwiseMin(b).array()).all() && (p.array() <= a.cwiseMax(b).array()).all();
}

bool meet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
          const Eigen::Vector2d& d) {
  const int ac = side(a, b, c);
  const int ad = side(a, b, d);
  const int ca = side(c, d, a);
  const int cb = side(c, d, b);
  if (ac * ad < 0 && ca * cb < 0) return true;
  return (ac == 0 && between(a, b, c)) || (ad == 0 && between(a, b, d)) ||
         (ca == 0 && between(c, d, a)) || (cb == 0 && between(c, d, b));
}

/// Two sides of a polygon that meet without being neighbours, or that fold back on each other.
std::optional<std::pair<std::size_t, std::size_t>> meeting_sides(const Polygon& points) {
  const std::size_t n = points.size();
  const auto start = [&](std::size_t k) -> const Eigen::Vector2d& { return points[k % n]; };
  const auto least = [&](std::size_t k) { return std::min(start(k).x(), start(k + 1).x()); };
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return std::pair(least(i), i) < std::pair(least(j), j);
  });
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t i = order[p];
    const double end = std::max(start(i).x(), start(i + 1).x());
    for (std::size_t q = p + 1; q < n && least(order[q]) <= end; ++q) {
      const std::size_t j = order[q];
      const bool follows = (i + 1) % n == j;
      const bool leads = (j + 1) % n == i;
      if (follows || leads) {
        const std::size_t k = follows ? j : i;
        const Eigen::Vector2d back = start(k + n - 1) - start(k);
        const Eigen::Vector2d on = start(k + 1) - start(k);
        if (cross(back, on) == 0.0 && back.dot(on) > 0.0) return std::pair(i, j);
      } else if (meet(start(i), start(i + 1), start(j), start(j + 1))) {
        return std::pair(i, j);
      }
    }
  }
  return std::nullopt;
}

std::string place_text(const Eigen::Vector2d& p) {
  return number_text(p.x()) + ", " + number_text(p.y());
}

}  // namespace

double polygon_area(const std::vector<Eigen::Vector2d>& points) {
  double doubled = 0.0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    doubled += cross(points[k] - points.front(), points[(k + 1) % points.size()] - points.front());
  }
  return 0.5 * doubled;
}

Outline circle_outline(const Eigen::Vector2d& size) {
  const double radius = 0.5 * size.minCoeff();
  Polygon points;
  for (int quarter = 0; quarter < 4; ++quarter) {
    add_quarter(0.5 * size, radius, quarter, points);
    points.pop_back();
  }
  return {OutlineKind::kCircle, radius, without_repeats(std::move(points))};
}

Outline rounded_outline(const Eigen::Vector2d& size, double radius) {
  const Eigen::Vector2d low = Eigen::Vector2d::Constant(radius);
  const Eigen::Vector2d high = size - low;
  Polygon points;
  add_quarter(high, radius, 0, points);
  add_quarter({low.x(), high.y()}, radius, 1, points);
  add_quarter(low, radius, 2, points);
  add_quarter({high.x(), low.y()}, radius, 3, points);
  for (Eigen::Vector2d& p : points) p = p.cwiseMax(0.0).cwiseMin(size);
  return {OutlineKind::kRoundedRectangle, radius, without_repeats(std::move(points))};
}

Outline polygon_outline(const Eigen::Vector2d& size, std::vector<Eigen::Vector2d> points) {
  points = without_repeats(std::move(points));
  if (polygon_area(points) < 0.0) std::reverse(points.begin(), points.end());
  Eigen::Vector2d low = points.front();
  Eigen::Vector2d high = low;
  for (const Eigen::Vector2d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double scale = size.cwiseQuotient(high - low).minCoeff();
  const Eigen::Vector2d from = 0.5 * (low + high);
  for (Eigen::Vector2d& p : points) {
    p = (0.5 * size + scale * (p - from)).cwiseMax(0.0).cwiseMin(size);
  }
  return {OutlineKind::kPolygon, 0.0, std::move(points)};
}

std::string outline_words(const Outline& outline) {
  switch (outline.kind) {
    case OutlineKind::kCircle:
      return "circle of " + number_text(2.0 * outline.radius) + " mm";
    case OutlineKind::kRoundedRectangle:
      return "corners of radius " + number_text(outline.radius) + " mm";
    case OutlineKind::kPolygon:
      break;
  }
  return "polygon of " + std::to_string(outline.points.size()) + " corners, " +
         number_text(polygon_area(outline.points)) + " mm2";
}

std::optional<std::string> polygon_fault(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 3 || points.size() > kMaxOutlinePoints) {
    return "it has " + std::to_string(points.size()) + " corners: must have 3 to " +
           std::to_string(kMaxOutlinePoints);
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].allFinite()) return "corner " + std::to_string(k) + " is not finite";
    if (points[k] == points[(k + 1) % points.size()]) {
      return "corner " + std::to_string(k) + " at " + place_text(points[k]) + " stands twice";
    }
  }
  if (const auto sides = meeting_sides(points)) {
    return "it crosses or touches itself near " + place_text(points[sides->first]) +
           ": must be one closed line";
  }
  if (!(std::abs(polygon_area(points)) > 0.0)) return "it has no area";
  return std::nullopt;
}

}  // namespace lensforge
