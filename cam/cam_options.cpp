// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_options.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "cam/finish_setup.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

[[noreturn]] void refuse(const char* option, double value, const std::string& rule) {
  throw InputError(std::string(option) + ": " + shortest_text(value) + " " + rule);
}

/// NaN fails every comparison and so is refused as well.
void require_in(const char* option, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    refuse(option, value, "is not between " + shortest_text(low) + " and " + shortest_text(high));
  }
}

/// A tolerance has to leave room for rounding: a quarter of it.
void validate_decimals(const CamOptions& options) {
  if (options.decimals != 0)
    require_in("--decimals", options.decimals, 4, options.post.most_decimals);
  const double tolerance = options.workshop.process.finish.tolerance;
  const double finest = 4.0 * resolution_of(options);
  if (!(tolerance >= finest * (1.0 - 1e-12))) {
    refuse("--tolerance", tolerance,
           "is not at least 4 units of the last decimal, " + shortest_text(finest) + " mm");
  }
}

void validate_polish(const CamOptions& options) {
  require_in("--polish-sigma", options.polish.sigma, 0.0, cam_limit::kPolish);
  require_in("--rim-depth", options.polish.rim_depth, 0.0, cam_limit::kPolish);
  require_in("--rim-length", options.polish.rim_length, cam_limit::kLeastRim, cam_limit::kRim);
  if (options.sample_spacing == 0.0) return;
  require_in("--sample-spacing", options.sample_spacing, cam_limit::kFinestSample,
             cam_limit::kCoarsestSample);
  if (options.polish.sigma > 0.0 && options.sample_spacing > options.polish.sigma) {
    refuse("--sample-spacing", options.sample_spacing,
           "is larger than --polish-sigma, " + shortest_text(options.polish.sigma) +
               " mm, which it could not show");
  }
}

void validate_limits(const CutLimits& limits) {
  const std::pair<const char*, double> all[] = {{"--max-leakage", limits.leakage},
                                                {"--max-dark", limits.dark_flux},
                                                {"--max-mae-increase", limits.mae_increase},
                                                {"--max-gouge", limits.gouge},
                                                {"--max-excess", limits.excess},
                                                {"--max-slope", limits.slope},
                                                {"--max-fillet", limits.fillet_depth}};
  for (const auto& [option, limit] : all) require_in(option, limit, 0.0, cam_limit::kLimit);
}

/// Before hours are spent on programs that the controller could not read.
void validate_tool_numbers(const CamOptions& options) {
  if (!options.post.changes_tools()) return;
  const Process& process = options.workshop.process;
  const GcodeDialect& reader = options.post.reader;
  const auto check = [&](int tool) {
    if (tool <= reader.max_tool) return;
    refuse("tool number", tool,
           "is above " + std::to_string(reader.max_tool) + ", the largest that a post read as " +
               reader.name + " can call; number the tool from 1 to " +
               std::to_string(reader.max_tool) + " in the workshop");
  };
  check(process.finish.tool);
  if (process.rough.enabled) check(process.rough.tool);
  if (process.semi.enabled) check(process.semi.tool);
}

}  // namespace

const char* words_for(SurfaceModel surface) {
  return surface == SurfaceModel::kSmooth ? "smooth, over the mesh" : "facets of the mesh";
}

const char* words_for(ZZero zero) {
  switch (zero) {
    case ZZero::kStock:
      return "top of the blank";
    case ZZero::kLens:
      return "highest point of the finished surface";
    case ZZero::kTable:
      break;
  }
  return "the face that the blank lies on";
}

double sample_spacing(const CamOptions& options) {
  if (options.sample_spacing > 0.0) return options.sample_spacing;
  const FinishProcess& finish = options.workshop.process.finish;
  const double pitch = finish_pitch(finish, options.workshop.tool(finish.tool).radius());
  return std::clamp(std::max(pitch / 6.0, options.polish.sigma / 3.0), cam_limit::kFinestSample,
                    cam_limit::kCoarsestSample);
}

void validate(const CamOptions& options, const OpticalSetup& setup) {
  validate(options.workshop, "workshop");
  const Tool& ball = options.workshop.tool(options.workshop.process.finish.tool);
  const double smallest = setup.lens_size.minCoeff();
  if (!(ball.diameter < smallest)) {
    refuse(
        "--tool-diameter", ball.diameter,
        "is not smaller than the lens, whose shorter side is " + shortest_text(smallest) + " mm");
  }
  require_in("--spin-up", options.spin_up, 0.0, cam_limit::kSpinUp);
  require_in("--shrinkage", options.shrinkage, 0.0, cam_limit::kShrinkage);
  validate_tool_numbers(options);
  validate_decimals(options);
  validate_polish(options);
  require_in("--dark-below", options.leakage.dark_below, 0.0, cam_limit::kDark);
  validate_limits(options.limits);
}

}  // namespace lensforge
