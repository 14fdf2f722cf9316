// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

#include "cam/contact/cut_surface.h"
#include "cam/path/finish_raster.h"
#include "cam/path/move.h"
#include "cam/path/operation.h"
#include "cam/workshop/tool.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

namespace lensforge {

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
