// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cam/contact/ball_blend.h"
#include "cam/contact/cut_surface.h"
#include "cam/path/operation.h"
#include "cam/path/row_fit.h"
#include "cam/path/row_profile.h"
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

namespace lensforge {

/// Slope up to which a surface is finished to its rim: rise over run. Lenses stay below 0.5.
inline constexpr double kSteepestSlope = 1.0;

/// What shapes a finishing raster but the surface and the ball.
struct RasterOptions {
  double pitch = 0.06;            ///< Stepover between rows at most, mm, > 0.
  double tolerance = 0.0005;      ///< Farthest from the drop curve, mm, ≥ 4 · resolution.
  double slope_tolerance = 1e-3;  ///< Largest difference of slope over a kSlopeStretch, > 0.
  double resolution = 1e-6;       ///< Unit of the program's last decimal, mm, > 0.
  double z_zero = 0.0;            ///< Height that the program calls 0, mm, lens frame.
  int along = 0;                  ///< 0: rows along x; 1: along y.
  PassStyle style = PassStyle::kZigzag;
  bool arcs = false;      ///< Arcs in the rows' planes, G18 along x and G19 along y.
  double shortest = 0.0;  ///< RowFitOptions::shortest on surfaces without creases, mm.
  bool traces = false;    ///< Rows also tell RasterRow::exact and unrounded.
  /// Slope up to which the surface is finished to its rim, rise over run, > 0.
  double rim_slope = kSteepestSlope;
  /// The number of rows between the borders of the surface is a multiple of this, ≥ 1.
  int every = 1;
};

/// Stepover of rows that lie `pitch` apart along a surface that rises across them by `steepest`
/// (rise over run): what keeps finish_pitch()'s scallop there, too.
double pitch_on_slope(double pitch, double steepest);

/// Decimals from 4 to 6, the least whose rounding turns a kSlopeStretch by no more than a quarter
/// of the slope tolerance and moves a point by no more than a quarter of the tolerance.
int decimals_for(double tolerance, double slope_tolerance);

/// A finishing raster over a rectangle: rows along x (or y), one behind the other along y (x).
///
/// The rim: a surface that falls towards its rim is touched by a ball whose centre is beyond it, so
/// rows and the raster as a whole run on. Out to reach(), R/√2 by default, the ball rolls over the
/// rim as the drop curve says, which finishes the surface to the rim for slopes up to rim_slope.
/// From there the tip keeps its height, and rows turn around a full radius outside, where the ball
/// no longer touches the part. On a blank as large as the lens all this is in air; on a larger
/// blank it cuts a channel that is one ball wider than the lens and nowhere deeper below the rim
/// than 0.3 R.
struct RasterPlan {
  Eigen::AlignedBox2d surface;  ///< Rectangle to finish, mm.
  double radius = 0.0;          ///< Of the ball, mm.
  RasterOptions options;
  double pitch = 0.0;     ///< Stepover as cut: rows lie on both borders of the surface.
  std::int64_t rows = 0;  ///< Of them rows_outside beyond either border.
  std::int64_t rows_outside = 0;
  /// If given, rows are cut only where the larger ball leaves something; must outlive the plan.
  const RestMap* rest = nullptr;

  /// How far beyond the rim the tip follows the drop curve, mm.
  [[nodiscard]] double reach() const;
  /// y (or x) of a row, mm, to the program's resolution.
  [[nodiscard]] double row_place(std::int64_t row) const;
  /// The way of a row; beyond reach() the drop curve is taken at the nearest place within it, where
  /// it is no lower, since that place is nearer to all of the surface.
  [[nodiscard]] RowSpan row_span(std::int64_t row) const;
  /// What is cut of a row, in its direction: all of it without `rest`. Spans are level for
  /// kLevelEnd beyond the drop curve.
  [[nodiscard]] std::vector<RowSpan> row_spans(std::int64_t row) const;
  [[nodiscard]] bool forward(std::int64_t row) const;
};

RasterPlan plan_finish_raster(const Eigen::AlignedBox2d& surface, double radius,
                              const RasterOptions& options);

/// The tip's way over a row.
struct RasterWay {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  std::vector<PathMove> moves;  ///< All kCut, feed 0.
};

/// One pass; x, y, z and centres lie on the program's grid.
struct RasterRow : RasterWay {
  RasterWay exact;              ///< The drop curve to kExactRow, if asked for.
  RasterWay unrounded;          ///< The same moves before their numbers are rounded, if asked for.
  PathCertificate certificate;  ///< Against the drop curve as continued beyond the rim.
  std::int64_t pieces = 0;      ///< Of the drop curve's polyline.

  [[nodiscard]] const Eigen::Vector3d& end() const {
    return moves.empty() ? start : moves.back().end;
  }
};

/// What parts of rows run on level where they end within the surface, mm: the ball is clear of it
/// there (BallBlend::kRunOut).
inline constexpr double kLevelEnd = 0.01;

/// What the exact way of a row is off the drop curve at most, as a share of the tolerances.
inline constexpr double kExactRow = 0.2;

/// Length of a straight move or of an arc of less than half a circle, mm.
double row_move_length(const Eigen::Vector3d& start, const PathMove& move);

/// Cuts one row, or a part of it (fit_row()).
/// @throw InputError if there is nothing under the ball somewhere on the row.
RasterRow cut_row(const RowCurves& curves, const RasterPlan& plan, std::int64_t row);
RasterRow cut_row(const RowCurves& curves, const RasterPlan& plan, std::int64_t row,
                  const RowSpan& span);

/// What a raster added up to.
struct RasterSummary {
  bool complete = false;  ///< False if it was stopped.
  std::int64_t rows = 0;
  std::int64_t pieces = 0;
  std::int64_t points = 0;  ///< Starts of rows and ends of moves.
  std::int64_t arcs = 0;
  double length = 0.0;      ///< Of the rows and of straight links from row to row, mm.
  Eigen::AlignedBox3d tip;  ///< Box of all points.
  PathCertificate certificate;
};

/// Cuts all rows, several at a time, and hands them, or their parts, to `sink` in order: the same
/// for any number of threads. Memory does not grow with the number of rows.
RasterSummary cut_raster(const CutSurface& surface, const RasterPlan& plan,
                         const Executor& executor,
                         const std::function<void(const RasterRow&)>& sink,
                         const RunControl& control);

/// How a finishing operation is run.
struct FinishRun {
  std::string name = "finish";  ///< OperationSummary::name; "cross" for a raster across.
  Tool tool;                    ///< A ball of the plan's radius.
  double safe_z = 0.0;          ///< Height of rapids, mm, lens frame, on the program's grid.
  double clearance = 0.0;       ///< Of rapids between parts of rows above the surface, mm, ≥ 0.
  std::function<void(const RasterRow&)> look = {};  ///< Is shown every row as well, in order.
};

/// The moves of a raster in order, from the safe height to the safe height.
///
/// In: a rapid over the first row's start, a full radius outside the rim, and down at plunge feed.
/// To and fro, the way from row to row is a straight one at feed outside the rim, where the ball
/// does not touch the part; it is made at plunge feed where it goes down steeply, as are moves of
/// rows with which a larger ball comes down from a lift. One way, the tool goes up by what the
/// row's highest point takes and straight back over the row just cut: a ball that is raised stays
/// within what the tool swept when it cut, so it meets neither the finished surface nor stock; then
/// it steps over at feed and goes down at plunge feed, both outside the rim. From one part of a row
/// to the next (RasterPlan::rest) it goes up by the clearance above all of the surface that it
/// passes, across, and down to where the larger ball has finished. Memory does not grow with the
/// number of rows.
/// @return complete is false if `control` asked for an end.
/// @throw InputError if there is nothing under the ball somewhere on a row.
OperationSummary cut_finish(const CutSurface& surface, const RasterPlan& plan, const FinishRun& run,
                            const Executor& executor, const MoveSink& sink,
                            const RunControl& control);

}  // namespace lensforge
