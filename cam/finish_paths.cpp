// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/finish_paths.h"

#include <array>
#include <span>

#include "cam/post/program_reader.h"
#include "core/error.h"

namespace lensforge {
namespace {

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
  const auto made = [&](Eigen::Vector3d point) {
    point[stretch.axis] *= stretch.factor;
    return point;
  };
  if (!stretch.any()) return path.add(motion);
  if (motion.arc && motion.arc->third != stretch.axis) {
    const int chords = chords_of(*motion.arc, BallPath::kHelixError);
    for (int k = 0; k < chords; ++k) {
      path.add(straight(made(motion.arc->at(k / double(chords))),
                        made(motion.arc->at((k + 1) / double(chords)))));
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
