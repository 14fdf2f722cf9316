// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/finish_setup.h"

#include <algorithm>
#include <cmath>

#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Moves are meant to be this many times as long as the controller needs: some are cut in two.
constexpr double kAboveShortest = 2.0;

/// What the path's direction is aimed at, at least, for each millimetre of the last decimal: finer
/// aims than the decimals can hold leave nothing but moves of a few micrometres, which turn more.
constexpr double kGridSlope = 10.0;

RasterPlan finish_raster(const CamOptions& options, const FinishGround& ground, PassAxis along) {
  const FinishProcess& finish = options.workshop.process.finish;
  const double radius = finishing_ball(options).radius();
  RasterOptions raster;
  raster.pitch = finish_pitch(finish, radius);
  if (finish.scallop > 0.0) raster.pitch = pitch_on_slope(raster.pitch, ground.steepest);
  raster.tolerance = finish.tolerance;
  raster.slope_tolerance = aimed_slope(options);
  raster.resolution = resolution_of(options);
  raster.z_zero = -ground.z_offset;
  raster.along = along == PassAxis::kX ? 0 : 1;
  raster.style = finish.style;
  raster.arcs = options.arcs && options.post.arcs != ArcForm::kNone;
  raster.shortest = shortest_move(options, finishing_ball(options));
  raster.traces = options.render;
  if (larger_ball(options) != nullptr) raster.every = finish.large_every;
  return plan_finish_raster(ground.rectangle, radius, raster);
}

}  // namespace

const Tool& finishing_ball(const CamOptions& options) {
  return options.workshop.tool(options.workshop.process.finish.tool);
}

const Tool* larger_ball(const CamOptions& options) {
  const int number = options.workshop.process.finish.large_tool;
  return number == 0 ? nullptr : &options.workshop.tool(number);
}

int decimals_of(const CamOptions& options) {
  if (options.decimals > 0) return options.decimals;
  const FinishProcess& finish = options.workshop.process.finish;
  return std::min(options.post.most_decimals,
                  decimals_for(finish.tolerance, finish.slope_tolerance));
}

double resolution_of(const CamOptions& options) { return std::pow(10.0, -decimals_of(options)); }

double aimed_slope(const CamOptions& options) {
  return std::max(options.workshop.process.finish.slope_tolerance,
                  kGridSlope * resolution_of(options));
}

std::string decimals_warning(const CamOptions& options) {
  const double stated = options.workshop.process.finish.slope_tolerance;
  const double aimed = aimed_slope(options);
  if (aimed <= stated) return {};
  const double rounding = resolution_of(options) / kSlopeStretch;
  return "with " + std::to_string(decimals_of(options)) +
         " decimals rounding turns the path by up to " + number_text(1e3 * rounding) +
         " mrad over 5 µm, so that its direction is aimed at " + number_text(1e3 * aimed) +
         " mrad instead of " + number_text(1e3 * stated) +
         " (--slope-tolerance); take a post with 6 decimals where its limit has to hold";
}

double shortest_move(const CamOptions& options, const Tool& tool) {
  const double lines = options.workshop.machine.lines_per_second;
  return lines > 0.0 ? kAboveShortest * tool.feed / (60.0 * lines) : 0.0;
}

std::vector<RasterPlan> finish_rasters(const CamOptions& options, const FinishGround& ground) {
  const FinishProcess& finish = options.workshop.process.finish;
  std::vector<RasterPlan> plans{finish_raster(options, ground, finish.along)};
  const PassAxis across = finish.along == PassAxis::kX ? PassAxis::kY : PassAxis::kX;
  if (finish.cross) plans.push_back(finish_raster(options, ground, across));
  return plans;
}

PencilOptions pencil_options(const CamOptions& options, double z_offset, double top) {
  PencilOptions pencil;
  pencil.resolution = resolution_of(options);
  pencil.z_zero = -z_offset;
  pencil.top = top;
  pencil.clearance = options.workshop.process.clearance;
  return pencil;
}

}  // namespace lensforge
