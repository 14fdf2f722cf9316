// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/leakage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <utility>

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

/// What every picture of a chain is judged by.
struct Judge {
  const Image& target;
  const FluxPicture& designed;
  std::vector<double> dark;
  std::vector<double> bright;

  [[nodiscard]] double dark_ratio(const FluxPicture& picture) const {
    const double bright_mean = weighted(bright, picture.flux) / count_of(bright);
    const double dark_mean = weighted(dark, picture.flux) / std::max(1.0, count_of(dark));
    return bright_mean > 0.0 ? dark_mean / bright_mean : 0.0;
  }

  [[nodiscard]] PictureQuality judge(const FluxPicture& picture) const {
    PictureQuality quality;
    quality.metrics = compare(picture.image(target.total()), target);
    quality.metrics.flux_inside = picture.inside();
    quality.leakage = leakage_share(picture, designed);
    quality.dark_flux = weighted(dark, picture.flux);
    quality.dark_ratio = dark_ratio(picture);
    return quality;
  }
};

/// Pictures of every surface of a chain, each rendered once. Steps come first: what they are made
/// of, among others the designed surface, is then at hand.
class ChainPictures {
 public:
  ChainPictures(const LeakageChain& chain, const FieldRenderSetup& setup, const Executor& executor,
                const RunControl& control)
      : setup_(setup), executor_(executor), control_(control) {
    std::vector<const SurfaceField*> fields;
    const auto take = [&](const NamedSurface& surface) {
      LF_CHECK(surface.field != nullptr, surface.name);
      const bool known = std::find(fields.begin(), fields.end(), surface.field) != fields.end();
      if (!surface.grid && !known) fields.push_back(surface.field);
    };
    for (const NamedSurface& step : chain.steps) take(step);
    take(chain.designed);
    for (const NamedSurface& other : chain.others) take(other);
    std::vector<FluxPicture> rendered = render_fields(fields, setup, executor, control);
    for (std::size_t f = 0; f < fields.size(); ++f) pictures_[fields[f]] = std::move(rendered[f]);
  }

  [[nodiscard]] FluxPicture of(const NamedSurface& surface) const {
    if (!surface.grid) return pictures_.at(surface.field);
    FieldRenderSetup setup = setup_;
    setup.grid = *surface.grid;
    return render_field(*surface.field, setup, executor_, control_);
  }

 private:
  const FieldRenderSetup& setup_;
  const Executor& executor_;
  const RunControl& control_;
  std::map<const SurfaceField*, FluxPicture> pictures_;
};

void check(const LeakageOptions& options) {
  if (options.dark_below >= 0.0 && options.bright_from > options.dark_below) return;
  throw InputError("dark pixels are those below " + std::to_string(options.dark_below) +
                   " of the mean, bright ones those from " + std::to_string(options.bright_from) +
                   ": dark must be at least 0 and below bright");
}

std::vector<CausePart> parts_of(const LeakageResult& result) {
  std::vector<CausePart> parts;
  const PictureQuality* before = &result.designed.quality;
  for (const RenderedSurface& step : result.steps) {
    const PictureQuality& now = step.quality;
    parts.push_back({step.name, now.leakage - before->leakage, now.dark_flux - before->dark_flux,
                     now.dark_ratio - before->dark_ratio});
    before = &now;
  }
  return parts;
}

}  // namespace

double PictureQuality::contrast() const {
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

std::vector<double> pixels_with_surplus(const FluxPicture& part, const FluxPicture& designed) {
  std::vector<double> more(part.flux.size());
  std::transform(part.flux.begin(), part.flux.end(), designed.flux.begin(), more.begin(),
                 [](double a, double b) { return a > b ? 1.0 : 0.0; });
  return more;
}

std::vector<double> surplus(const FluxPicture& part, const FluxPicture& designed) {
  const auto pixels = static_cast<double>(part.flux.size());
  std::vector<double> excess(part.flux.size());
  std::transform(part.flux.begin(), part.flux.end(), designed.flux.begin(), excess.begin(),
                 [pixels](double a, double b) { return pixels * std::max(0.0, a - b); });
  return excess;
}

LeakageResult measure_leakage(const LeakageChain& chain, const Image& target,
                              const FieldRenderSetup& setup, const LeakageOptions& options,
                              const Executor& executor, const RunControl& control) {
  check(options);
  LF_CHECK(!chain.steps.empty(), chain.designed.name);
  LF_CHECK(target.columns() == setup.optics.pixels.x() && target.rows() == setup.optics.pixels.y(),
           std::to_string(target.columns()) + "x" + std::to_string(target.rows()));
  const ChainPictures pictures(chain, setup, executor, control);
  LeakageResult result;
  result.designed = {chain.designed.name, pictures.of(chain.designed), {}};
  const double mean = mean_of(target);
  const Judge judge{target, result.designed.picture,
                    mask_of(target, [&](double v) { return v < options.dark_below * mean; }),
                    mask_of(target, [&](double v) { return v >= options.bright_from * mean; })};
  result.designed.quality = judge.judge(result.designed.picture);
  const auto add = [&](const NamedSurface& surface, std::vector<RenderedSurface>& to) {
    to.push_back({surface.name, pictures.of(surface), {}});
    to.back().quality = judge.judge(to.back().picture);
  };
  for (const NamedSurface& step : chain.steps) add(step, result.steps);
  for (const NamedSurface& other : chain.others) add(other, result.others);
  result.parts = parts_of(result);
  result.dark = judge.dark;
  result.dark_pixels = std::llround(count_of(judge.dark));
  result.bright_pixels = std::llround(count_of(judge.bright));
  return result;
}

}  // namespace lensforge
