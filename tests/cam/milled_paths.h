// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "cam/contact/drop_cutter.h"
#include "cam/milled/ball_sweep.h"
#include "core/lens/surface_field.h"

namespace lensforge::testing {

/// Straight motions through points of the tool's tip.
inline void add_polyline(BallPath& path, const std::vector<Eigen::Vector3d>& tips) {
  for (std::size_t i = 1; i < tips.size(); ++i) {
    GcodeMotion motion;
    motion.start = tips[i - 1];
    motion.end = tips[i];
    path.add(motion);
  }
}

/// One arc of the tool's tip.
inline GcodeMotion arc_motion(ArcPlane plane, bool clockwise, const Eigen::Vector3d& start,
                              const Eigen::Vector3d& end, const Eigen::Vector3d& offset) {
  GcodeMotion motion;
  motion.start = start;
  motion.end = end;
  motion.arc = make_arc(start, end, {plane, clockwise, offset, {}}).arc;
  return motion;
}

/// A window whose nodes lie at origin + spacing · (i, j).
inline GridWindow window_at(const Eigen::Vector2d& origin, double spacing, std::int64_t columns,
                            std::int64_t rows) {
  return {origin, {spacing, spacing}, columns, rows};
}

inline SurfacePatch sampled(const SurfaceField& field, const GridWindow& window) {
  SurfacePatch patch;
  field.sample(window, Executor::serial(), patch);
  return patch;
}

/// A zig-zag raster with links from row to row, `pitch` apart, over a square from (0, 0) and a
/// radius beyond it: the drop-cutter's tips every `step`, rounded to a ten-thousandth as a program
/// has them; where nothing is under the ball the row is left out.
inline BallPath raster_path(const DropCutter& cutter, double side, double pitch, double step) {
  const auto rounded = [](double value) { return std::round(value * 1e4) / 1e4; };
  BallPath path(cutter.radius(), 0.0);
  GcodeMotion motion;
  const double beyond = 0.7 * cutter.radius();
  const auto rows = static_cast<std::int64_t>((side + 2.0 * beyond) / pitch);
  const auto points = static_cast<std::int64_t>((side + 2.0 * beyond) / step);
  bool begun = false;
  for (std::int64_t row = 0; row <= rows; ++row) {
    CutterLocation near;
    for (std::int64_t k = 0; k <= points; ++k) {
      const std::int64_t along = row % 2 == 0 ? k : points - k;
      const Eigen::Vector2d p(rounded(static_cast<double>(along) * step - beyond),
                              rounded(static_cast<double>(row) * pitch - beyond));
      near = cutter.drop(p, near);
      if (!near.rests()) continue;
      motion.start = motion.end;
      motion.end = {p.x(), p.y(), rounded(near.tip)};
      if (begun) path.add(motion);
      begun = true;
    }
  }
  return path;
}

}  // namespace lensforge::testing
