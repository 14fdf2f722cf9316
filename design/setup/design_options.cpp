// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/setup/design_options.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/optics/picture_blur.h"
#include "core/text/number_text.h"
#include "design/schedule/levels.h"
#include "design/setup/option_tables.h"
#include "design/spline/made_surface.h"

namespace lensforge {
namespace {

void require(bool rule, const std::string& option, double value, const std::string& text) {
  if (rule) return;
  throw InputError(option + " " + number_text(value) + ": " + text);
}

void require_all_in_range(const DesignOptions& o) {
  require_limits(o);
  require_limits(o.light);
  require_limits(o.second);
  require_limits(o.weights);
  require(o.focal_length > o.thickness, "--focal", o.focal_length,
          "must be above the thickness of the lens, " + number_text(o.thickness) + " mm");
  require(o.iterations >= 1, "--quality, iterations", o.iterations, "must be at least 1");
}

void require_process(const DesignOptions& o) {
  if (!o.made_by) return;
  require(o.made_by->polish_sigma > 0.0, "--made-by, polish.sigma", o.made_by->polish_sigma,
          "must be above 0: a part that is not polished shows no picture");
  require(o.made_by->pitch > 0.0, "--made-by, finish.pitch", o.made_by->pitch, "must be above 0");
  if (o.model != SurfaceModel::kSpline) {
    throw InputError("--made-by: needs --model spline, not " + model_name(o.model));
  }
}

/// @throw InputError unless waves can be followed, or need not be.
void require_waves(const DesignOptions& o) {
  if (o.light.model == LightModel::kWaves && o.model != SurfaceModel::kSpline) {
    throw InputError("--light-model waves: needs --model spline, not " + model_name(o.model));
  }
  if (o.light.spectrum.none() || o.light.wavelength_nm == LightOptions().wavelength_nm) return;
  require(false, "--wavelength", o.light.wavelength_nm,
          "--wavelengths already gives those of the light");
}

/// @throw InputError naming the finest polish that can be computed for a lens of this size.
void require_coarse_polish(const DesignOptions& o, const Eigen::Vector2i& pixels) {
  if (!o.made_by) return;
  const double least = AveragingGrid::least_sigma(optical_setup(o, pixels).lens_size);
  require(o.made_by->polish_sigma >= least, "--made-by, polish.sigma", o.made_by->polish_sigma,
          "is too fine to be computed for a lens of " + number_text(o.width) + " mm; at least " +
              number_text(std::ceil(1e5 * least) / 1e5) + " mm, or --model spline without it");
}

/// Minimum longer side at which a picture's shorter side has enough pixels.
int least_pixels(const Image& picture) {
  int longer = kMinPixels;
  while (working_size(picture.columns(), picture.rows(), longer).minCoeff() < kMinPixels) ++longer;
  return longer;
}

/// @throw InputError naming a longer side that works, if the shorter side has too few pixels.
void require_wide_enough(const Eigen::Vector2i& pixels, const Image& picture, int longer_side) {
  if (pixels.minCoeff() >= kMinPixels) return;
  const std::string least = std::to_string(kMinPixels);
  const int shorter = std::min(picture.columns(), picture.rows());
  if (shorter < kMinPixels) {
    throw InputError("the picture's shorter side " + std::to_string(shorter) +
                     ": must have at least " + least +
                     " pixels; crop the longer one and enlarge it");
  }
  throw InputError("--pixels " + std::to_string(longer_side) + ": leaves the shorter side " +
                   std::to_string(pixels.minCoeff()) + " pixels, must be at least " + least +
                   "; --pixels " + std::to_string(least_pixels(picture)) + " works");
}

}  // namespace

DesignOptions default_design_options(SurfaceModel model, const Image& target) {
  DesignOptions options;
  options.model = model;
  options.weights.smooth = default_smoothness(model);
  options.pixels = std::min(options.pixels, std::max(target.columns(), target.rows()));
  return options;
}

DesignOptions with_smoothness_applied(DesignOptions options) {
  options.weights.smooth *= options.smoothness;
  options.smoothness = 1.0;
  return options;
}

bool follows_waves(const DesignOptions& options, const OpticalSetup& setup) {
  if (options.light.model == LightModel::kRays || options.model != SurfaceModel::kSpline) {
    return false;
  }
  const double wavelength = wave_options(options, setup).wavelength;
  return options.light.model == LightModel::kWaves ||
         waves_show(light_blurs(setup, options.thickness, wavelength));
}

WaveOptions wave_options(const DesignOptions& options, const OpticalSetup& setup) {
  WaveOptions waves;
  waves.wavelength = middle_wavelength(setup, kMmPerNm * options.light.wavelength_nm);
  return waves;
}

void validate(const DesignOptions& options, const Image& target) {
  const int longer = std::max(target.columns(), target.rows());
  require(longer >= kMinPixels, "the picture's longer side", longer, "must be at least 4 pixels");
  require_all_in_range(options);
  require_process(options);
  require_waves(options);
  require(longer >= options.pixels, "--pixels", options.pixels,
          "the picture's longer side has only " + std::to_string(longer) + " pixels");
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), options.pixels);
  require_wide_enough(pixels, target, options.pixels);
  require_light(options, pixels);
  require_coarse_polish(options, pixels);
  if (!(target.total() > 0.0)) {
    throw InputError("the picture is all black: there is no light to place");
  }
  require_second(options, target);
}

}  // namespace lensforge
