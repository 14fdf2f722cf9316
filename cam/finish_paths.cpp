// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/finish_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "cam/post/program_reader.h"
#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kStretchError = 1e-6;  ///< mm; as of helices (BallPath::kHelixError).
constexpr double kLongestPart = 1.0;    ///< rad; of less than half a turn the sweep is known.

GcodeMotion straight(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  GcodeMotion motion;
  motion.start = start;
  motion.end = end;
  motion.feed = 1.0;
  return motion;
}

GcodeMotion motion_of(const Eigen::Vector3d& start, const PathMove& move) {
  GcodeMotion motion = straight(start, move.end);
  if (move.arc_axis < 0) return motion;
  constexpr std::array<ArcPlane, 3> planes{ArcPlane::kYZ, ArcPlane::kZX, ArcPlane::kXY};
  const ArcRequest request{planes[static_cast<std::size_t>(move.arc_axis)], move.clockwise,
                           move.centre - start, std::nullopt};
  const ArcResult result = make_arc(start, move.end, request);
  LF_CHECK(result.reason.empty(), result.reason);
  motion.arc = result.arc;
  return motion;
}

/// The arc through three points of another one's plane, in its direction; straight where they are
/// on a line.
GcodeMotion through(const Eigen::Vector3d& start, const Eigen::Vector3d& middle,
                    const Eigen::Vector3d& end, const Arc& like) {
  GcodeMotion motion = straight(start, end);
  const auto flat = [&](const Eigen::Vector3d& point) {
    return Eigen::Vector2d(point[like.first] - start[like.first],
                           point[like.second] - start[like.second]);
  };
  const Eigen::Vector2d a = flat(middle);
  const Eigen::Vector2d b = flat(end);
  const double twice_area = a.x() * b.y() - a.y() * b.x();
  if (twice_area == 0.0) return motion;
  const Eigen::Vector2d centre =
      Eigen::Vector2d(b.y() * a.squaredNorm() - a.y() * b.squaredNorm(),
                      a.x() * b.squaredNorm() - b.x() * a.squaredNorm()) /
      (2.0 * twice_area);
  const double chord = std::min(1.0, 0.5 * b.norm() / centre.norm());
  Arc arc = like;
  arc.centre = start;
  arc.centre[like.first] += centre.x();
  arc.centre[like.second] += centre.y();
  arc.radius = centre.norm();
  arc.begin = std::atan2(-centre.y(), -centre.x());
  arc.sweep = std::copysign(2.0 * std::asin(chord), like.sweep);
  arc.rise = end[like.third] - start[like.third];
  motion.arc = arc;
  return motion;
}

/// So many arcs through points of a stretched one stay within kStretchError of it. With the share e
/// its curvature changes by 3 e / r² along it at most, from which an arc of length l through its
/// ends and its middle is off by l³ / (72 √3) times that.
int parts_of(const Arc& arc, double share) {
  const double off = std::abs(share) * arc.radius / (24.0 * std::numbers::sqrt3);
  const double longest = std::min(kLongestPart, std::cbrt(kStretchError / off));
  return std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep) / longest)));
}

void add_way(const RasterWay& way, BallPath& path) {
  Eigen::Vector3d at = way.start;
  for (const PathMove& move : way.moves) {
    path.add(motion_of(at, move));
    at = move.end;
  }
}

}  // namespace

void add_row(const RasterRow& row, FinishPaths& paths) {
  add_way(row.exact, paths.ideal.back());
  add_way(row.unrounded, paths.fitted.back());
}

AxisStretch AxisStretch::of(const FinishProcess& finish) {
  return {finish.along == PassAxis::kX ? 1 : 0, 1.0 + finish.pitch_error};
}

void add_stretched(const GcodeMotion& motion, const AxisStretch& stretch, BallPath& path) {
  if (!stretch.any()) return path.add(motion);
  const auto made = [&](Eigen::Vector3d point) {
    point[stretch.axis] *= stretch.factor;
    return point;
  };
  if (motion.arc && motion.arc->third != stretch.axis) {
    const Arc& arc = *motion.arc;
    const int parts = parts_of(arc, stretch.factor - 1.0);
    for (int k = 0; k < parts; ++k) {
      const auto at = [&](double share) { return made(arc.at((k + share) / parts)); };
      path.add(through(at(0.0), at(0.5), at(1.0), arc));
    }
    return;
  }
  GcodeMotion whole = motion;
  whole.start = made(motion.start);
  whole.end = made(motion.end);
  if (whole.arc) whole.arc->centre = made(whole.arc->centre);
  path.add(whole);
}

MoveSink path_sink(BallPath& path, const AxisStretch& stretch) {
  return [&path, stretch,
          at = Eigen::Vector3d(Eigen::Vector3d::Zero())](std::span<const PathMove> moves) mutable {
    for (const PathMove& move : moves) {
      if (move.kind != MoveKind::kRapid) add_stretched(motion_of(at, move), stretch, path);
      at = move.end;
    }
  };
}

void read_path(const std::filesystem::path& program, const GcodeDialect& dialect, int tool,
               const std::function<void(const GcodeMotion&)>& take, const RunControl& control) {
  const auto pass_on = [&](const GcodeMotion& motion, int used) {
    if (!motion.rapid && (used == tool || used == 0)) take(motion);
  };
  read_program(program, dialect, pass_on, control);
}

}  // namespace lensforge
