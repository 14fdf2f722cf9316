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

namespace lensforge {

/// Slope up to which a surface is finished to its rim: rise over run. Lenses stay below 0.5.
inline constexpr double kSteepestSlope = 1.0;

/// Options of a finishing raster.
struct RasterOptions {
  double pitch = 0.06;        ///< Maximum stepover between rows, mm, > 0.
  double tolerance = 0.0005;  ///< Maximum distance from the drop curve, mm, ≥ 4 · resolution.
  double slope_tolerance = 1e-3;  ///< Largest difference of slope over a kSlopeStretch, > 0.
  double resolution = 1e-6;       ///< Unit of the program's last decimal, mm, > 0.
  double z_zero = 0.0;            ///< Height that the program calls 0, mm, lens frame.
  int along = 0;                  ///< 0: rows along x; 1: along y.
  PassStyle style = PassStyle::kZigzag;
  bool arcs = false;      ///< Arcs in the rows' planes, G18 along x and G19 along y.
  double shortest = 0.0;  ///< RowFitOptions::shortest on surfaces without creases, mm.
  bool traces = false;    ///< Rows also record RasterRow::exact and unrounded.
  /// Slope up to which the surface is finished to its rim, rise over run, > 0.
  double rim_slope = kSteepestSlope;
  /// The number of rows between the borders of the surface is a multiple of this, ≥ 1.
  int every = 1;
  double apron = 0.0;  ///< Width of the surface's continuation around it, mm, ≥ 0.
};

/// Number of decimals, 4 to 6: the smallest whose rounding changes the slope over a kSlopeStretch
/// by at most a quarter of the slope tolerance and moves a point by at most a quarter of the
/// tolerance.
int decimals_for(double tolerance, double slope_tolerance);

/// A finishing raster over a rectangle and its apron: rows along x (or y), one behind the other
/// along y (x).
///
/// The rim of what is finished, the apron's outer one: a ball that touches a surface falling
/// towards it has its centre beyond it, so rows and the raster extend beyond the rim. Within
/// reach(), R/√2 by default, the ball follows the drop curve over the rim, which finishes the
/// surface to the rim for slopes up to rim_slope. Beyond, the tip keeps its height, and rows turn a
/// full radius outside, where the ball no longer touches the surface. On a blank no larger all this
/// is in air; on a larger one it cuts a channel one ball wider and at most 0.3 R below the rim.
struct RasterPlan {
  Eigen::AlignedBox2d surface;  ///< Rectangle to finish, mm, without its apron.
  double radius = 0.0;          ///< Of the ball, mm.
  RasterOptions options;
  double pitch = 0.0;     ///< Stepover as cut: rows lie on both borders of the surface.
  std::int64_t rows = 0;  ///< Of them rows_outside beyond each border.
  std::int64_t rows_outside = 0;
  /// If given, rows are cut only where the larger ball leaves material; must outlive the plan.
  const RestMap* rest = nullptr;

  /// The surface with its apron.
  [[nodiscard]] Eigen::AlignedBox2d finished() const;
  /// Distance beyond the rim of that to which the tip follows the drop curve, mm.
  [[nodiscard]] double reach() const;
  /// y (or x) of a row, mm, rounded to the program's resolution.
  [[nodiscard]] double row_place(std::int64_t row) const;
  /// The extent of a row. Beyond reach() it uses the drop curve at the nearest place within reach,
  /// which is no lower because that place is closer to all of the surface.
  [[nodiscard]] RowSpan row_span(std::int64_t row) const;
  /// The parts of a row that are cut, in its direction: the whole row without `rest`. Spans are
  /// level for kLevelEnd beyond the drop curve.
  [[nodiscard]] std::vector<RowSpan> row_spans(std::int64_t row) const;
  [[nodiscard]] bool forward(std::int64_t row) const;
};

RasterPlan plan_finish_raster(const Eigen::AlignedBox2d& surface, double radius,
                              const RasterOptions& options);

/// The tip's path over a row.
struct RasterWay {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  std::vector<PathMove> moves;  ///< All kCut, feed 0.
};

/// One pass; x, y, z and centres lie on the program's grid.
struct RasterRow : RasterWay {
  RasterWay exact;              ///< The drop curve to kExactRow, if asked for.
  RasterWay unrounded;          ///< The same moves before rounding, if asked for.
  PathCertificate certificate;  ///< Against the drop curve as continued beyond the rim.
  std::int64_t pieces = 0;      ///< Of the drop curve's polyline.

  [[nodiscard]] const Eigen::Vector3d& end() const {
    return moves.empty() ? start : moves.back().end;
  }
};

/// Level end of a row's part that ends within the surface, mm: the ball is clear of the surface
/// there (BallBlend::kRunOut).
inline constexpr double kLevelEnd = 0.01;

/// Maximum error of a row's exact path, as a share of the tolerances.
inline constexpr double kExactRow = 0.2;

/// Length of a straight move or of an arc of less than half a circle, mm.
double row_move_length(const Eigen::Vector3d& start, const PathMove& move);

/// Cuts one row, or a part of it (fit_row()).
/// @throw InputError if there is nothing under the ball somewhere on the row.
RasterRow cut_row(const RowCurves& curves, const RasterPlan& plan, std::int64_t row);
RasterRow cut_row(const RowCurves& curves, const RasterPlan& plan, std::int64_t row,
                  const RowSpan& span);

/// Totals of a raster.
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

/// Cuts all rows, several at a time, and passes them, or their parts, to `sink` in order: the same
/// for any number of threads. Memory does not grow with the number of rows.
RasterSummary cut_raster(const CutSurface& surface, const RasterPlan& plan,
                         const Executor& executor,
                         const std::function<void(const RasterRow&)>& sink,
                         const RunControl& control);

/// Options for running a finishing operation.
struct FinishRun {
  std::string name = "finish";  ///< OperationSummary::name; "cross" for a raster across.
  Tool tool;                    ///< A ball of the plan's radius.
  double safe_z = 0.0;          ///< Height of rapids, mm, lens frame, on the program's grid.
  double clearance = 0.0;       ///< Of rapids between parts of rows above the surface, mm, ≥ 0.
  std::function<void(const RasterRow&)> look = {};  ///< Is also shown every row, in order.
};

/// Passes the moves of a raster to `sink`, from the safe height to the safe height.
///
/// The tool starts with a rapid over the first row's start, a full radius outside the rim, and goes
/// down at plunge feed. To and fro, links between rows are straight and at feed outside the rim,
/// where the ball does not touch the part; links that descend steeply run at plunge feed, as do
/// moves of rows with which a larger ball comes down from a lift. One way, the tool rises to the
/// row's highest point and returns straight over the row just cut: a raised ball stays within what
/// the tool swept when it cut, so it meets neither the finished surface nor stock. Then it steps
/// over at feed and descends at plunge feed, both outside the rim. Between parts of a row
/// (RasterPlan::rest) it rises to the clearance above all of the surface in between, crosses, and
/// comes down where the larger ball has finished. Memory does not grow with the number of rows.
/// @return complete is false if `control` asked for an end.
/// @throw InputError if there is nothing under the ball somewhere on a row.
OperationSummary cut_finish(const CutSurface& surface, const RasterPlan& plan, const FinishRun& run,
                            const Executor& executor, const MoveSink& sink,
                            const RunControl& control);

}  // namespace lensforge
