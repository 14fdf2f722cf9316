// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/leakage.h"

#include <algorithm>
#include <map>
#include <span>
#include <utility>

#include "core/error.h"

namespace lensforge {
namespace {

/// Pictures of every surface of a chain, each rendered once. Steps come first: what they are made
/// of, among others the designed surface, is then at hand.
class ChainPictures {
 public:
  ChainPictures(const LeakageChain& chain, const FieldRenderSetup& setup, const Executor& executor,
                const RunControl& control, const TileObserver& observe) {
    std::vector<const SurfaceField*> fields;
    std::vector<const NamedSurface*> apart;
    const auto take = [&](const NamedSurface& surface) {
      LF_CHECK(surface.field != nullptr, surface.name);
      if (std::find(fields.begin(), fields.end(), surface.field) != fields.end()) return;
      if (surface.grid) return apart.push_back(&surface);
      fields.push_back(surface.field);
    };
    for (const NamedSurface& step : chain.steps) take(step);
    take(chain.designed);
    for (const NamedSurface& other : chain.others) take(other);
    std::vector<FluxPicture> rendered = render_fields(fields, setup, executor, control, observe);
    for (std::size_t f = 0; f < fields.size(); ++f) pictures_[fields[f]] = std::move(rendered[f]);
    for (const NamedSurface* surface : apart) {
      FieldRenderSetup own = setup;
      own.grid = *surface->grid;
      pictures_[surface->field] = render_field(*surface->field, own, executor, control);
    }
  }

  [[nodiscard]] const FluxPicture& of(const NamedSurface& surface) const {
    return pictures_.at(surface.field);
  }

 private:
  std::map<const SurfaceField*, FluxPicture> pictures_;
};

PointLight point_light(const NamedSurface& designed, const FluxPicture& blurred,
                       const FieldRenderSetup& setup, const PictureJudge& judge,
                       const Executor& executor, const RunControl& control) {
  FieldRenderSetup sharp = setup;
  sharp.optics.extent = {};
  PointLight point{{designed.name, render_field(*designed.field, sharp, executor, control), {}}};
  point.designed.quality = judge.judge(point.designed.picture);
  point.moved = leakage_share(blurred, point.designed.picture);
  return point;
}

std::vector<CausePart> parts_of(const LeakageResult& result) {
  std::vector<CausePart> parts;
  const PictureQuality* before = &result.designed.quality;
  const auto add = [&](const std::string& cause, const PictureQuality& now, double leakage) {
    parts.push_back(
        {cause, leakage, now.dark_flux - before->dark_flux, now.dark_ratio - before->dark_ratio});
    before = &now;
  };
  if (result.point) {
    before = &result.point->designed.quality;
    add(leak_cause::kSource, result.designed.quality, 0.0);
  }
  for (const RenderedSurface& step : result.steps) {
    add(step.name, step.quality, step.quality.leakage - before->leakage);
  }
  return parts;
}

}  // namespace

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
                              const Executor& executor, const RunControl& control,
                              const TileObserver& observe) {
  validate(options);
  LF_CHECK(!chain.steps.empty(), chain.designed.name);
  LF_CHECK(target.columns() == setup.optics.pixels.x() && target.rows() == setup.optics.pixels.y(),
           std::to_string(target.columns()) + "x" + std::to_string(target.rows()));
  const ChainPictures pictures(chain, setup, executor, control, observe);
  LeakageResult result;
  result.designed = {chain.designed.name, pictures.of(chain.designed), {}};
  const PictureJudge judge(target, result.designed.picture, options);
  result.designed.quality = judge.judge(result.designed.picture);
  if (!setup.optics.extent.none()) {
    result.point =
        point_light(chain.designed, result.designed.picture, setup, judge, executor, control);
  }
  const auto add = [&](const NamedSurface& surface, std::vector<RenderedSurface>& to) {
    to.push_back({surface.name, pictures.of(surface), {}});
    to.back().quality = judge.judge(to.back().picture);
  };
  for (const NamedSurface& step : chain.steps) add(step, result.steps);
  for (const NamedSurface& other : chain.others) add(other, result.others);
  result.parts = parts_of(result);
  result.dark = judge.dark();
  result.dark_pixels = judge.dark_pixels();
  result.bright_pixels = judge.bright_pixels();
  return result;
}

}  // namespace lensforge
