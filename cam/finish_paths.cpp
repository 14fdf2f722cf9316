// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/finish_paths.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "cam/path/row_profile.h"
#include "cam/post/program_reader.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// Rows that are in memory at once.
constexpr std::int64_t kRowsAtOnce = 64;

/// Joints of profiles are of no use here.
constexpr double kNoJoints = 1.0;

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

using Polyline = std::vector<Eigen::Vector3d>;

/// A row's drop curve, level beyond where it is held, in the order of travel.
Polyline row_polyline(const DropCutter& cutter, const RasterPlan& plan, std::int64_t row) {
  const RowSpan span = plan.row_span(row);
  const RowProfile profile = row_profile(cutter, span, kNoJoints);
  const int along = plan.options.along;
  Polyline points;
  points.reserve(profile.u.size());
  for (std::size_t i = 0; i < profile.u.size(); ++i) {
    Eigen::Vector3d point;
    point[along] = profile.u[i];
    point[1 - along] = plan.row_place(row);
    point.z() = profile.z[i];
    points.push_back(point);
  }
  if (!plan.forward(row)) std::reverse(points.begin(), points.end());
  return points;
}

/// The places of the axis over some rows.
Eigen::AlignedBox2d axis_box(const RasterPlan& plan, std::int64_t first, std::int64_t end) {
  Eigen::AlignedBox2d box;
  for (const std::int64_t row : {first, end - 1}) {
    const RowSpan span = plan.row_span(row);
    box.extend(span.line.at(span.from)).extend(span.line.at(span.to));
  }
  return box;
}

/// Rows that share a cutter.
std::int64_t rows_in_band(const CutSurface& surface, const RasterPlan& plan) {
  const double rows = std::min(surface.band() / plan.pitch, static_cast<double>(kRowsAtOnce));
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(rows));
}

}  // namespace

BallPath ideal_path(const CutSurface& surface, const RasterPlan& plan, const Executor& executor,
                    const RunControl& control) {
  BallPath path(plan.radius, 0.0);
  const std::int64_t band = rows_in_band(surface, plan);
  for (std::int64_t first = 0; first < plan.rows; first += band) {
    if (control.stop_requested()) throw Interrupted();
    const std::int64_t end = std::min(first + band, plan.rows);
    const auto cutter = surface.cutter(axis_box(plan, first, end), executor);
    std::vector<Polyline> rows(static_cast<std::size_t>(end - first));
    parallel_for(
        executor, "exact rows", end - first,
        [&](std::int64_t i) {
          rows[static_cast<std::size_t>(i)] = row_polyline(*cutter, plan, first + i);
        },
        1);
    for (const Polyline& row : rows) {
      for (std::size_t i = 1; i < row.size(); ++i) path.add(straight(row[i - 1], row[i]));
    }
    control.report(
        {"exact drop curves", static_cast<double>(end), static_cast<double>(plan.rows), ""});
  }
  return path;
}

MoveSink path_sink(BallPath& path) {
  return [&path,
          at = Eigen::Vector3d(Eigen::Vector3d::Zero())](std::span<const PathMove> moves) mutable {
    for (const PathMove& move : moves) {
      if (move.kind != MoveKind::kRapid) path.add(motion_of(at, move));
      at = move.end;
    }
  };
}

void read_path(const std::filesystem::path& program, const GcodeDialect& dialect, int tool,
               BallPath& path, const RunControl& control) {
  const auto take = [&](const GcodeMotion& motion, int used) {
    if (!motion.rapid && (used == tool || used == 0)) path.add(motion);
  };
  read_program(program, dialect, take, control);
}

}  // namespace lensforge
