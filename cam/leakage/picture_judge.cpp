// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/picture_judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

double mean_of(const Image& target) {
  return target.total() / static_cast<double>(target.values().size());
}

/// 1 for every pixel of the target that `chosen` takes, 0 for the others.
template <class Chosen>
std::vector<double> mask_of(const Image& target, const Chosen& chosen) {
  std::vector<double> mask(target.values().size());
  std::transform(target.values().begin(), target.values().end(), mask.begin(),
                 [&](float value) { return chosen(static_cast<double>(value)) ? 1.0 : 0.0; });
  return mask;
}

double weighted(const std::vector<double>& weights, const std::vector<double>& flux) {
  return std::inner_product(weights.begin(), weights.end(), flux.begin(), 0.0);
}

double count_of(const std::vector<double>& mask) {
  return std::accumulate(mask.begin(), mask.end(), 0.0);
}

}  // namespace

void validate(const LeakageOptions& options) {
  if (options.dark_below >= 0.0 && options.bright_from > options.dark_below) return;
  throw InputError("dark pixels are those below " + std::to_string(options.dark_below) +
                   " of the mean, bright ones those from " + std::to_string(options.bright_from) +
                   ": dark must be at least 0 and below bright");
}

double contrast_of(double dark_ratio) {
  return dark_ratio > 0.0 ? 1.0 / dark_ratio : std::numeric_limits<double>::infinity();
}

double leakage_share(const FluxPicture& picture, const FluxPicture& designed) {
  double excess = 0.0;
  for (std::size_t i = 0; i < picture.flux.size(); ++i) {
    excess += std::max(0.0, picture.flux[i] - designed.flux[i]);
  }
  const double all = designed.inside();
  return all > 0.0 ? excess / all : 0.0;
}

PictureJudge::PictureJudge(const Image& target, const FluxPicture& designed,
                           const LeakageOptions& options)
    : target_(target), designed_(designed) {
  validate(options);
  const double mean = mean_of(target);
  dark_ = mask_of(target, [&](double v) { return v < options.dark_below * mean; });
  bright_ = mask_of(target, [&](double v) { return v >= options.bright_from * mean; });
}

PictureQuality PictureJudge::judge(const FluxPicture& picture) const {
  PictureQuality quality;
  quality.metrics = compare(picture.image(target_.total()), target_);
  quality.metrics.flux_inside = picture.inside();
  quality.leakage = leakage_share(picture, designed_);
  quality.dark_flux = weighted(dark_, picture.flux);
  quality.dark_ratio = dark_ratio(picture);
  return quality;
}

std::int64_t PictureJudge::dark_pixels() const { return std::llround(count_of(dark_)); }
std::int64_t PictureJudge::bright_pixels() const { return std::llround(count_of(bright_)); }

double PictureJudge::dark_ratio(const FluxPicture& picture) const {
  const double bright_mean = weighted(bright_, picture.flux) / count_of(bright_);
  const double dark_mean = weighted(dark_, picture.flux) / std::max(1.0, count_of(dark_));
  return bright_mean > 0.0 ? dark_mean / bright_mean : 0.0;
}

}  // namespace lensforge
