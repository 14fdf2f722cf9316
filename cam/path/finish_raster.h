// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "cam/contact/drop_cutter.h"
#include "core/executor.h"
#include "core/run_control.h"

namespace lensforge {

/// What shapes a finishing raster but the surface and the ball.
struct RasterOptions {
  double pitch = 0.06;            ///< Stepover between rows at most, mm, > 0.
  double tolerance = 0.0005;      ///< Farthest from the drop curve, mm, ≥ 4 · resolution.
  double slope_tolerance = 1e-3;  ///< Largest error of a move's direction, rad, > 0.
  double resolution = 1e-4;       ///< Unit of the program's last decimal, mm, > 0.
};

/// Slope up to which the raster's promises hold: rise over run of the surface, and of the drop
/// curve across the rim. Lenses stay below 0.5.
inline constexpr double kSteepestSlope = 1.0;

/// A zig-zag finishing raster over a rectangle: rows along x, one behind the other along y.
///
/// The rim: a surface that falls towards its rim is touched by a ball whose centre is beyond it, so
/// rows and the raster as a whole run on. Out to reach() = R/√2 the ball rolls over the rim as the
/// drop curve says, which finishes the surface to the rim for slopes up to kSteepestSlope. From
/// there the tip keeps its height, and rows turn around a full radius outside, where the ball no
/// longer touches the part. On a blank as large as the lens all this is in air; on a larger blank
/// it cuts a channel that is one ball wider than the lens and nowhere deeper below the rim than 0.3
/// R.
struct RasterPlan {
  Eigen::AlignedBox2d surface;  ///< Rectangle to finish, mm.
  double radius = 0.0;          ///< Of the ball, mm.
  RasterOptions options;
  double pitch = 0.0;     ///< Stepover as cut: rows lie on both borders of the surface.
  std::int64_t rows = 0;  ///< Of them rows_outside beyond either border.
  std::int64_t rows_outside = 0;
  std::int64_t samples = 0;  ///< Drop-curve samples a row, before creases are searched.
  double spacing = 0.0;      ///< Distance of samples at most, mm.

  /// How far beyond the rim the tip follows the drop curve, mm.
  [[nodiscard]] double reach() const;
  /// y of a row, mm, to the program's resolution.
  [[nodiscard]] double row_y(std::int64_t row) const;
};

/// Lays out the raster. Samples are s = √(0.7 R · tolerance) apart: the drop curve is the largest
/// of curves whose second derivative is at least −(1 + M²)^(3/2)/R, M being its slope, so between
/// samples it rises above their chord by at most (1 + M²)^(3/2) s²/(8R) ≤ tolerance/4 for M ≤ 1.
RasterPlan plan_finish_raster(const Eigen::AlignedBox2d& surface, double radius,
                              const RasterOptions& options);

/// One pass: cutter location points (tool tip, mm, lens frame; x and y to the program's resolution)
/// in the order of travel, even rows towards +x.
struct RasterRow {
  std::vector<Eigen::Vector3d> points;
  std::int64_t samples = 0;  ///< Points at which the drop curve was evaluated.
};

/// Cuts one row: samples the drop curve, halves intervals next to a crease until its place is
/// known, and keeps as few samples as the tolerances allow. Between neighbouring points the drop
/// curve rises above the path by at most the tolerance (the deepest gouge) and falls below it by at
/// most the tolerance, rounding of z to the resolution included; every chord is within
/// slope_tolerance of the direction of each sample interval that it replaces
/// (FinishRaster.NeverGougesDeeperThanTheTolerance).
/// @throw InputError if there is nothing under the ball somewhere on the row.
RasterRow cut_row(const DropCutter& cutter, const RasterPlan& plan, std::int64_t row);

/// What a raster added up to.
struct RasterSummary {
  bool complete = false;  ///< False if it was stopped.
  std::int64_t rows = 0;
  std::int64_t samples = 0;
  std::int64_t points = 0;
  double length = 0.0;      ///< Of the path with the links from row to row, mm.
  Eigen::AlignedBox3d tip;  ///< Box of all points.
};

/// Cuts all rows, several at a time, and hands them to `sink` in order: the same rows for any
/// number of threads. Memory does not grow with the number of rows.
RasterSummary cut_raster(const DropCutter& cutter, const RasterPlan& plan, const Executor& executor,
                         const std::function<void(const RasterRow&)>& sink,
                         const RunControl& control);

}  // namespace lensforge
