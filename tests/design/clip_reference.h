// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "design/flux/flux_triangle.h"

/// The slow way to a flux picture: every triangle is clipped with every pixel (Sutherland & Hodgman
/// 1974) in extended precision.
namespace lensforge::testing {

using Real = long double;

struct Point {
  Real x = 0.0L;
  Real y = 0.0L;
};

using Polygon = std::vector<Point>;

/// The part of a polygon where `inside`, a linear function of the point, is not negative.
template <class Linear>
Polygon clip(const Polygon& polygon, const Linear& inside) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point& p = polygon[i];
    const Point& q = polygon[(i + 1) % polygon.size()];
    const Real at_p = inside(p);
    const Real at_q = inside(q);
    if (at_p >= 0.0L) result.push_back(p);
    if ((at_p < 0.0L && at_q > 0.0L) || (at_p > 0.0L && at_q < 0.0L)) {
      const Real s = at_p / (at_p - at_q);
      result.push_back({p.x + s * (q.x - p.x), p.y + s * (q.y - p.y)});
    }
  }
  return result;
}

inline Real signed_area(const Polygon& polygon) {
  Real doubled = 0.0L;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Point& o = polygon[0];
    const Point& a = polygon[i];
    const Point& b = polygon[i + 1];
    doubled += (a.x - o.x) * (b.y - o.y) - (b.x - o.x) * (a.y - o.y);
  }
  return 0.5L * doubled;
}

inline Polygon clip_to_row(const Polygon& polygon, int row) {
  const Polygon below = clip(polygon, [row](const Point& p) { return p.y - row; });
  return clip(below, [row](const Point& p) { return static_cast<Real>(row) + 1.0L - p.y; });
}

inline Polygon clip_to_column(const Polygon& polygon, int column) {
  const Polygon right = clip(polygon, [column](const Point& p) { return p.x - column; });
  return clip(right, [column](const Point& p) { return static_cast<Real>(column) + 1.0L - p.x; });
}

/// Corners in extended precision: room for the steps of a finite difference.
using RealTriangle = std::array<Point, 3>;

inline RealTriangle real_corners(const ImageTriangle& t) {
  return {{{t.p0.x(), t.p0.y()}, {t.p1.x(), t.p1.y()}, {t.p2.x(), t.p2.y()}}};
}

/// Calls visit(pixel number, share of the triangle's area) for every pixel of columns × rows that
/// the triangle touches, were it only in a point.
template <class Visit>
void for_each_touched_pixel(const RealTriangle& t, int columns, int rows, const Visit& visit) {
  const Polygon whole(t.begin(), t.end());
  const Real area = signed_area(whole);
  for (int row = 0; row < rows; ++row) {
    const Polygon strip = clip_to_row(whole, row);
    if (strip.empty()) continue;
    for (int column = 0; column < columns; ++column) {
      const Polygon part = clip_to_column(strip, column);
      if (!part.empty()) visit(row * columns + column, signed_area(part) / area);
    }
  }
}

}  // namespace lensforge::testing
