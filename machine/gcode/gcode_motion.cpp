// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
/// An arc that turns less than this is a full circle: the end point was rounded on its way.
constexpr double kNoTurn = 5e-7;
constexpr double kRadiusTolerance = 0.005;  ///< mm
constexpr double kRadiusLimit = 0.5;        ///< mm
constexpr double kRadiusShare = 0.001;

Arc in_plane(ArcPlane plane) {
  Arc arc;
  switch (plane) {
    case ArcPlane::kXY:
      break;
    case ArcPlane::kZX:
      arc.first = 2;
      arc.second = 0;
      arc.third = 1;
      break;
    case ArcPlane::kYZ:
      arc.first = 1;
      arc.second = 2;
      arc.third = 0;
      break;
  }
  return arc;
}

/// The centre lies on the chord's bisector, h from its middle, h² = r² − (d/2)²; to the left of the
/// chord for a counter-clockwise arc of less than half a turn.
std::string place_centre(Arc& arc, const Eigen::Vector2d& start, const Eigen::Vector2d& end,
                         const ArcRequest& request) {
  const double radius = *request.radius;
  const Eigen::Vector2d chord = end - start;
  const double length = chord.norm();
  if (length == 0.0) return "an arc with R needs an end point other than its start";
  double square = radius * radius - 0.25 * length * length;
  if (square < -1e-9 * length * length) return "the radius R is too small to reach the end point";
  square = std::max(square, 0.0);
  const double side = (radius > 0.0) == request.clockwise ? -1.0 : 1.0;
  const Eigen::Vector2d left(-chord.y() / length, chord.x() / length);
  const Eigen::Vector2d centre = 0.5 * (start + end) + side * std::sqrt(square) * left;
  arc.centre[arc.first] = centre.x();
  arc.centre[arc.second] = centre.y();
  arc.radius = std::abs(radius);
  return {};
}

std::string take_offset(Arc& arc, const Eigen::Vector2d& start, const Eigen::Vector2d& end,
                        const ArcRequest& request) {
  if (request.offset[arc.third] != 0.0) return "the arc's centre is not in its plane";
  const Eigen::Vector2d offset(request.offset[arc.first], request.offset[arc.second]);
  const Eigen::Vector2d centre = start + offset;
  arc.centre[arc.first] = centre.x();
  arc.centre[arc.second] = centre.y();
  arc.radius = offset.norm();
  const double error = std::abs((end - centre).norm() - arc.radius);
  if (arc.radius == 0.0) return "the arc has no radius";
  const bool off = error > kRadiusLimit || error > kRadiusShare * arc.radius;
  if (error > kRadiusTolerance && off) {
    return "the arc's end is " + number_text(error) + " mm off the circle through its start";
  }
  return {};
}

double sweep_between(double begin, double end, bool clockwise) {
  double sweep = std::remainder(end - begin, kTurn);
  if (clockwise && sweep >= -kNoTurn) sweep -= kTurn;
  if (!clockwise && sweep <= kNoTurn) sweep += kTurn;
  return sweep;
}

}  // namespace

double Arc::length() const { return std::hypot(radius * sweep, rise); }

Eigen::Vector3d Arc::at(double part) const {
  const double angle = begin + part * sweep;
  Eigen::Vector3d point;
  point[first] = centre[first] + radius * std::cos(angle);
  point[second] = centre[second] + radius * std::sin(angle);
  point[third] = centre[third] + part * rise;
  return point;
}

Eigen::AlignedBox3d Arc::bounds() const {
  Eigen::AlignedBox3d box(at(0.0));
  box.extend(at(1.0));
  const double low = std::min(begin, begin + sweep);
  const double high = std::max(begin, begin + sweep);
  const double quarter = 0.25 * kTurn;
  for (double k = std::ceil(low / quarter); k * quarter <= high; k += 1.0) {
    box.extend(at((k * quarter - begin) / sweep));
  }
  return box;
}

ArcResult make_arc(const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                   const ArcRequest& request) {
  ArcResult result;
  Arc& arc = result.arc;
  arc = in_plane(request.plane);
  const Eigen::Vector2d from(start[arc.first], start[arc.second]);
  const Eigen::Vector2d to(end[arc.first], end[arc.second]);
  result.reason =
      request.radius ? place_centre(arc, from, to, request) : take_offset(arc, from, to, request);
  if (!result.reason.empty()) return result;
  const Eigen::Vector2d centre(arc.centre[arc.first], arc.centre[arc.second]);
  arc.centre[arc.third] = start[arc.third];
  arc.rise = end[arc.third] - start[arc.third];
  arc.begin = std::atan2(from.y() - centre.y(), from.x() - centre.x());
  const double angle = std::atan2(to.y() - centre.y(), to.x() - centre.x());
  arc.sweep = sweep_between(arc.begin, angle, request.clockwise);
  return result;
}

}  // namespace lensforge
