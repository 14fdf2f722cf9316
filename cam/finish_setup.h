// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "cam/cam_options.h"
#include "cam/path/finish_raster.h"
#include "cam/path/pencil.h"

namespace lensforge {

/// The finishing ball.
const Tool& finishing_ball(const CamOptions& options);

/// The larger ball that finishes wherever it reaches; none if the finishing ball does it alone.
const Tool* larger_ball(const CamOptions& options);

/// Digits after the point in the programs: as chosen, or what the tolerances ask for.
int decimals_of(const CamOptions& options);

/// Unit of the programs' last decimal, mm.
double resolution_of(const CamOptions& options);

/// What the path's direction is aimed at, rad: the workshop's slope tolerance, or what the
/// programs' decimals can hold if that is more.
double aimed_slope(const CamOptions& options);

/// That the decimals are too few for the slope tolerance, in a sentence; empty if they are not.
std::string decimals_warning(const CamOptions& options);

/// Length that moves of a tool should have at least, mm: the controller takes no more lines a
/// second. 0 where it has no such limit.
double shortest_move(const CamOptions& options, const Tool& tool);

/// What the finishing is laid out on; mm, lens frame.
struct FinishGround {
  Eigen::AlignedBox2d rectangle;  ///< Of what is cut.
  double steepest = 0.0;          ///< Rise over run of its steepest place.
  double z_offset = 0.0;          ///< Program Z − lens-frame z.
};

/// The finishing raster, and the one across if it is wanted.
std::vector<RasterPlan> finish_rasters(const CamOptions& options, const FinishGround& ground);

/// For the pass along the creases. @param top  highest point of what is cut, mm, lens frame.
PencilOptions pencil_options(const CamOptions& options, double z_offset, double top);

}  // namespace lensforge
