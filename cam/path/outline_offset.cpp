// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/outline_offset.h"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/error.h"

namespace lensforge {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Point, false>;
using Polygons = bg::model::multi_polygon<Polygon>;

/// Chords of a full circle around a corner.
constexpr int kChords = 720;

/// Corners that stand out less than this from the line between their neighbours are left out, mm.
constexpr double kSimplify = 0.002;

Polygons grown(const Polygon& polygon, double distance) {
  const bg::strategy::buffer::distance_symmetric<double> by(distance);
  const bg::strategy::buffer::join_round round(kChords);
  Polygons result;
  bg::buffer(polygon, result, by, bg::strategy::buffer::side_straight(), round,
             bg::strategy::buffer::end_round(kChords), bg::strategy::buffer::point_circle(kChords));
  return result;
}

/// The largest part without what it encloses: no tool gets there from outside.
Polygon outer(const Polygons& polygons) {
  const auto largest = std::max_element(
      polygons.begin(), polygons.end(),
      [](const Polygon& a, const Polygon& b) { return bg::area(a) < bg::area(b); });
  LF_CHECK(largest != polygons.end(), "no polygon");
  Polygon result;
  result.outer() = largest->outer();
  return result;
}

}  // namespace

OutlineWay offset_outline(const std::vector<Eigen::Vector2d>& polygon, double radius) {
  Polygon part;
  for (const Eigen::Vector2d& p : polygon) bg::append(part.outer(), Point(p.x(), p.y()));
  bg::correct(part);
  // Chords lie inside of the circle around a corner; simplifying moves the way by kSimplify at
  // most.
  const double chord = std::cos(std::numbers::pi / kChords);
  const Polygon way = outer(grown(part, (radius + 0.5 * kOutlineOversize) / chord));
  Polygon simple;
  bg::simplify(way, simple, kSimplify);
  OutlineWay result;
  for (std::size_t k = 0; k + 1 < simple.outer().size(); ++k) {
    result.points.emplace_back(simple.outer()[k].x(), simple.outer()[k].y());
  }
  const double filled = bg::area(grown(way, -radius));
  const double rim = kOutlineOversize * static_cast<double>(bg::perimeter(part));
  result.left = std::max(0.0, filled - bg::area(part) - rim);
  return result;
}

}  // namespace lensforge
