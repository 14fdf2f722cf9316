// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracer/clipped_picture.h"

#include <algorithm>
#include <cmath>

namespace tracer {
namespace {

using Polygon = std::vector<Vec2>;

/// Without the part beyond a straight line across an axis (Sutherland and Hodgman 1974).
Polygon clipped(const Polygon& polygon, int axis, double bound, bool keep_above) {
  const auto depth = [&](const Vec2& p) { return keep_above ? p[axis] - bound : bound - p[axis]; };
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = polygon[(i + 1) % polygon.size()];
    if (depth(a) >= 0.0) kept.push_back(a);
    if ((depth(a) >= 0.0) != (depth(b) >= 0.0)) {
      kept.emplace_back(a + depth(a) / (depth(a) - depth(b)) * (b - a));
    }
  }
  return kept;
}

double area_of(const Polygon& polygon) {
  double doubled = 0.0;
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Vec2 u = polygon[i - 1] - polygon[0];
    const Vec2 v = polygon[i] - polygon[0];
    doubled += u.x() * v.y() - u.y() * v.x();
  }
  return 0.5 * std::abs(doubled);
}

/// Cells that a stretch touches, at most those of the picture.
struct Range {
  int first;
  int last;
};
Range cells_of(const Polygon& polygon, int axis, int count) {
  double low = polygon.front()[axis];
  double high = low;
  for (const Vec2& p : polygon) {
    low = std::min(low, p[axis]);
    high = std::max(high, p[axis]);
  }
  const auto cell = [](double at, int least, int most) {
    return static_cast<int>(std::floor(std::clamp<double>(at, least, most)));
  };
  return {cell(low, 0, count), cell(high, -1, count - 1)};
}

Polygon clipped_to_cell(const Polygon& polygon, int axis, int cell) {
  return clipped(clipped(polygon, axis, cell, true), axis, cell + 1.0, false);
}

}  // namespace

ClippedPicture::ClippedPicture(int columns, int rows)
    : columns_(columns),
      rows_(rows),
      light_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0.0) {}

void ClippedPicture::add(const Triangle& t, double light) {
  const Polygon whole(t.begin(), t.end());
  const double area = area_of(whole);
  if (!(area > 0.0)) return;
  const Range rows = cells_of(whole, 1, rows_);
  for (int row = rows.first; row <= rows.last; ++row) {
    const Polygon strip = clipped_to_cell(whole, 1, row);
    if (strip.empty()) continue;
    const Range columns = cells_of(strip, 0, columns_);
    for (int column = columns.first; column <= columns.last; ++column) {
      light_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
             static_cast<std::size_t>(column)] +=
          light * area_of(clipped_to_cell(strip, 0, column)) / area;
    }
  }
}

}  // namespace tracer
