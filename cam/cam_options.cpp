// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_options.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "cam/cam_fields.h"
#include "cam/finish_setup.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// How much farther apart samples may be along the passes than across them.
constexpr double kAlongPasses = 3.0;

/// The same as a share of the lens that a pixel's light comes from, on average: 0.15 of it predicts
/// the design of a 128² portrait with an MAE of 0.0020, which is 0.0018.
constexpr double kAlongPixel = 0.1;

/// How much farther apart nodes of a surface with all of its scallops may be along the passes, and
/// that as a share likewise: its light spreads over so many pixels that a picture of it takes
/// longer than those of all polished surfaces. As milled a 256² portrait of 100 mm has an MAE of
/// 0.0949 so, and 0.0947 otherwise.
constexpr double kAlongScallops = 3.0;
constexpr double kScallopPixel = 0.25;

[[noreturn]] void refuse(const char* option, double value, const std::string& rule) {
  throw InputError(std::string(option) + " " + shortest_text(value) + ": " + rule);
}

/// A tolerance has to leave room for rounding: a quarter of it.
void validate_decimals(const CamOptions& options) {
  if (options.decimals > options.post.most_decimals) {
    refuse("--decimals", options.decimals,
           "the post takes at most " + std::to_string(options.post.most_decimals));
  }
  const double tolerance = options.workshop.process.finish.tolerance;
  const double finest = 4.0 * resolution_of(options);
  if (!(tolerance >= finest * (1.0 - 1e-12))) {
    refuse("--tolerance", tolerance,
           "must be at least 4 units of the last decimal, " + shortest_text(finest) + " mm");
  }
}

void validate_sampling(const CamOptions& options) {
  if (options.workshop.polish.sigma > 0.0 &&
      options.sample_spacing > options.workshop.polish.sigma) {
    refuse("--sample-spacing", options.sample_spacing,
           "must be at most --polish-sigma, " + shortest_text(options.workshop.polish.sigma) +
               " mm, which it could not show");
  }
}

void validate_tolerances(const CamOptions& options) {
  if (options.tolerances > 0 && !options.render) {
    refuse("--tolerances", options.tolerances,
           "needs the predicted picture: leave out --no-render, or use --tolerances 0");
  }
  if (options.tolerances > 0 && larger_ball(options) != nullptr) {
    refuse("--tolerances", options.tolerances,
           "draws parts of one finishing ball only: set finish.large_tool = 0, or use "
           "--tolerances 0");
  }
}

/// Parts are blurred by the errors of a source that is a point otherwise.
void validate_tolerances(const CamOptions& options, const OpticalSetup& setup) {
  if (options.tolerances == 0) return;
  if (setup.outline) {
    refuse("--tolerances", options.tolerances,
           "draws parts of rectangular lenses only; use --tolerances 0");
  }
  if (setup.extent.none() && !setup.front) return;
  refuse("--tolerances", options.tolerances,
         "draws parts with a flat front, for the light of a point or of one direction only; use "
         "--tolerances 0");
}

void validate_outline(const CamOptions& options) {
  if (options.cut_outline == OutlineWish::kAlways && options.part == PartKind::kMould) {
    throw InputError("--cut-outline always: a mould keeps its blank; use --cut-outline never");
  }
  if (options.outline_tool > 0 && options.workshop.find_tool(options.outline_tool) == nullptr) {
    refuse("--outline-tool", options.outline_tool,
           "the workshop has no tool of this number; 0 takes the roughing tool");
  }
}

/// A lens with a curved front lies in a nest while it is cut, and its blank has the front already.
void validate_front(const CamOptions& options, const OpticalSetup& setup) {
  if (!setup.front || options.part != PartKind::kLens) return;
  if (options.z_zero == ZZero::kTable) {
    throw InputError(
        "--z-zero table: the lens's front is curved and has no plane to lie on; use stock or lens");
  }
  const auto* const sphere = std::get_if<SphericalFront>(&*setup.front);
  if (sphere == nullptr) return;  // A height map goes on straight beyond the lens.
  const double margin = options.workshop.stock.margin;
  const Eigen::Vector2d middle = 0.5 * setup.lens_size;
  const Eigen::Vector2d reach = (sphere->apex.head<2>() - middle).cwiseAbs() + middle;
  const double radius = std::abs(sphere->radius);
  if ((reach.array() + margin).matrix().norm() < radius) return;
  // (x + m)² + (y + m)² = R², rounded down.
  const double sum = reach.sum();
  const double most =
      0.5 * (std::sqrt(sum * sum - 2.0 * (reach.squaredNorm() - radius * radius)) - sum);
  refuse("stock.margin", margin,
         "the lens's front, a sphere of radius " + shortest_text(radius) +
             " mm, is too small for a blank of that margin; " +
             decimal_text(std::floor(10.0 * most) / 10.0, 1) + " mm would do");
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
  check(process.finish.large_tool);
  if (process.rough.enabled) check(process.rough.tool);
  if (process.semi.enabled) check(process.semi.tool);
  if (options.outline_tool > 0) check(options.outline_tool);
}

}  // namespace

const char* words_for(SurfaceModel surface) {
  switch (surface) {
    case SurfaceModel::kFacet:
      return "facets of the mesh";
    case SurfaceModel::kSmooth:
      break;
    case SurfaceModel::kSpline:
      return "the lens's spline";
  }
  return "smooth, over the mesh";
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
  return std::clamp(std::max(pitch / 6.0, options.workshop.polish.sigma / 3.0),
                    cam_limit::kFinestSample, cam_limit::kCoarsestSample);
}

Eigen::Vector2d sample_spacings(const CamOptions& options, const OpticalSetup& setup) {
  const FinishProcess& finish = options.workshop.process.finish;
  const double across = sample_spacing(options);
  Eigen::Vector2d spacings = Eigen::Vector2d::Constant(across);
  if (finish.cross) return spacings;
  // Scallops do not vary along passes. A Gaussian's weights σ apart sum to its integral but for
  // 5e-9.
  const int axis = finish.along == PassAxis::kX ? 0 : 1;
  const double pixel = setup.lens_size[axis] / setup.pixels[axis];
  const double along =
      std::min({kAlongPasses * across, options.workshop.polish.sigma, kAlongPixel * pixel});
  spacings[axis] = std::max(across, along);
  return spacings;
}

Eigen::Vector2d scallop_spacings(const CamOptions& options, const OpticalSetup& setup) {
  const FinishProcess& finish = options.workshop.process.finish;
  Eigen::Vector2d spacings = sample_spacings(options, setup);
  if (finish.cross) return spacings;
  const int axis = finish.along == PassAxis::kX ? 0 : 1;
  const double pixel = setup.lens_size[axis] / setup.pixels[axis];
  spacings[axis] =
      std::max(spacings[axis], std::min(kAlongScallops * spacings[axis], kScallopPixel * pixel));
  return spacings;
}

void validate(const CamOptions& options, const OpticalSetup& setup) {
  validate(options.workshop, "workshop");
  require_limits(cam_fields(), options);
  const Tool& ball = options.workshop.tool(options.workshop.process.finish.tool);
  const double smallest = setup.lens_size.minCoeff();
  if (!(ball.diameter < smallest)) {
    refuse(
        "--tool-diameter", ball.diameter,
        "must be smaller than the lens, whose shorter side is " + shortest_text(smallest) + " mm");
  }
  if (const Tool* const large = larger_ball(options); large && !(large->diameter < smallest)) {
    refuse("finish.large_tool", large->number,
           "its diameter, " + shortest_text(large->diameter) +
               " mm, must be smaller than the lens, whose shorter side is " +
               shortest_text(smallest) + " mm");
  }
  validate_tool_numbers(options);
  validate_decimals(options);
  validate_sampling(options);
  validate_tolerances(options);
  validate_tolerances(options, setup);
  validate_front(options, setup);
  validate_outline(options);
}

std::vector<Eigen::Vector2d> edge_of(const OpticalSetup& setup) {
  if (setup.outline) return setup.outline->points;
  const Eigen::Vector2d& size = setup.lens_size;
  return {{0.0, 0.0}, {size.x(), 0.0}, size, {0.0, size.y()}};
}

bool cuts_outline(const CamOptions& options, const OpticalSetup& setup) {
  if (options.part == PartKind::kMould) return false;
  if (options.cut_outline == OutlineWish::kIfShaped) return setup.outline.has_value();
  return options.cut_outline == OutlineWish::kAlways;
}

}  // namespace lensforge
