// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/leakage.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cam/leakage/render_field.h"
#include "core/error.h"

namespace lensforge {

double FluxPicture::inside() const { return std::accumulate(flux.begin(), flux.end(), 0.0); }

Image FluxPicture::image(double total) const {
  Image image(columns, rows);
  std::transform(flux.begin(), flux.end(), image.values().begin(),
                 [total](double share) { return static_cast<float>(share * total); });
  return image;
}

namespace {

double mean_of(const Image& target) {
  return target.total() / static_cast<double>(target.values().size());
}

/// 1 for every pixel of the target for which `chosen` is true, 0 for the others.
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

namespace {

/// Pictures of every surface of a chain, each rendered once. Steps come first: the surfaces that
/// they are made from, including the designed one, are then cached.
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

namespace {

GridWindow with_half_the_spacing(const GridWindow& grid) {
  GridWindow fine = grid;
  fine.spacing *= 0.5;
  fine.columns = 2 * (grid.columns - 1) + 1;
  fine.rows = 2 * (grid.rows - 1) + 1;
  return fine;
}

/// The same cells on that grid.
CellRange halved(const CellRange& cells) {
  return {2 * cells.column, 2 * cells.row, 2 * cells.columns, 2 * cells.rows};
}

struct Stretch {
  std::int64_t begin;
  std::int64_t count;
};

/// The middle of the `index`th of kSamplingWindows equal parts of a side of `cells` cells.
Stretch stretch(std::int64_t cells, int pixels, std::int64_t index) {
  const double window = kWindowPixels / pixels * static_cast<double>(cells);
  const std::int64_t part = std::max<std::int64_t>(1, cells / kSamplingWindows);
  const std::int64_t count = std::clamp<std::int64_t>(std::llround(window), 1, part);
  const std::int64_t middle = (2 * index + 1) * cells / (2 * kSamplingWindows);
  return {std::clamp<std::int64_t>(middle - count / 2, 0, cells - count), count};
}

std::vector<CellRange> windows_of(const FieldRenderSetup& setup) {
  const CellRange all = all_cells(setup.grid);
  std::vector<CellRange> windows;
  for (std::int64_t j = 0; j < kSamplingWindows; ++j) {
    for (std::int64_t i = 0; i < kSamplingWindows; ++i) {
      const Stretch x = stretch(all.columns, setup.optics.pixels.x(), i);
      const Stretch y = stretch(all.rows, setup.optics.pixels.y(), j);
      windows.push_back({x.begin, y.begin, x.count, y.count});
    }
  }
  return windows;
}

double area_of(const CellRange& cells) { return static_cast<double>(cells.columns * cells.rows); }

double mae_of(const FluxPicture& picture, const Image& target) {
  return compare(picture.image(target.total()), target).mae;
}

}  // namespace

SamplingCheck check_sampling(const SurfaceField& designed, const SurfaceField& part,
                             const LeakageResult& result, const Image& target,
                             const FieldRenderSetup& setup, const Executor& executor,
                             const RunControl& control) {
  const RunControl silent(control.stop_token(), {});
  FieldRenderSetup fine_setup = setup;
  fine_setup.grid = with_half_the_spacing(setup.grid);
  const std::vector<CellRange> windows = windows_of(setup);
  const auto with_fine_windows = [&](const SurfaceField& field, FluxPicture picture) {
    for (const CellRange& window : windows) {
      const FluxPicture coarse = render_cells(field, setup, window, executor, silent);
      const FluxPicture fine = render_cells(field, fine_setup, halved(window), executor, silent);
      for (std::size_t i = 0; i < picture.flux.size(); ++i) {
        picture.flux[i] += fine.flux[i] - coarse.flux[i];
      }
    }
    return picture;
  };
  const FluxPicture& before = result.part().picture;
  const FluxPicture now = with_fine_windows(part, before);
  const FluxPicture& design_before = result.designed.picture;
  const FluxPicture design_now = with_fine_windows(designed, design_before);
  double cells = 0.0;
  for (const CellRange& window : windows) cells += area_of(window);
  const double scale = area_of(all_cells(setup.grid)) / cells;
  return {setup.grid.spacing.minCoeff(),
          scale * (leakage_share(now, design_now) - leakage_share(before, design_before)),
          scale * (mae_of(now, target) - mae_of(before, target))};
}

}  // namespace lensforge
