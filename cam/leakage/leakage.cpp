// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/leakage.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cam/leakage/render_field.h"
#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/optics/optical_setup.h"
#include "core/optics/picture_blur.h"
#include "core/optics/polish_transfer.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/flux/flux_image.h"
#include "design/flux/flux_triangle.h"
#include "design/waves/wave_picture.h"

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

/// Every surface of a chain and its picture.
using ChainPictures = std::map<const SurfaceField*, FluxPicture>;

void add_once(const NamedSurface& surface, std::vector<const SurfaceField*>& fields) {
  LF_CHECK(surface.field != nullptr, surface.name);
  if (std::find(fields.begin(), fields.end(), surface.field) != fields.end()) return;
  fields.push_back(surface.field);
}

/// Steps come first: the surfaces that they are made from, including the designed one, are then
/// cached.
std::vector<const SurfaceField*> fields_of(const LeakageChain& chain) {
  std::vector<const SurfaceField*> fields;
  for (const NamedSurface& step : chain.steps) add_once(step, fields);
  add_once(chain.designed, fields);
  return fields;
}

ChainPictures pictures_by_rays(const LeakageChain& chain, const FieldRenderSetup& setup,
                               const Executor& executor, const RunControl& control) {
  std::vector<const SurfaceField*> fields = fields_of(chain);
  for (const NamedSurface& other : chain.others) {
    if (!other.grid) add_once(other, fields);
  }
  ChainPictures pictures;
  std::vector<FluxPicture> rendered =
      render_fields(fields, setup, executor, control, chain.observe);
  for (std::size_t f = 0; f < fields.size(); ++f) pictures[fields[f]] = std::move(rendered[f]);
  for (const NamedSurface& other : chain.others) {
    if (!other.grid || pictures.contains(other.field)) continue;
    FieldRenderSetup own = setup;
    own.grid = *other.grid;
    pictures[other.field] = render_field(*other.field, own, executor, control);
  }
  return pictures;
}

/// Surfaces with grids of their own have no rows, which scatter light.
ChainPictures pictures_by_waves(const LeakageChain& chain, const FieldRenderSetup& setup,
                                const WaveOptions& options, const Executor& executor,
                                const RunControl& control) {
  const Eigen::Vector2i& pixels = setup.optics.pixels;
  ChainPictures pictures;
  const auto render = [&](const std::vector<const SurfaceField*>& fields, const GridWindow& grid,
                          const WaveOptions& waves) {
    if (fields.empty()) return;
    std::vector<std::vector<double>> flux =
        wave_flux(setup.optics, grid, fields, waves, executor, control);
    for (std::size_t f = 0; f < fields.size(); ++f) {
      pictures[fields[f]] = {pixels.x(), pixels.y(), std::move(flux[f])};
    }
  };
  std::vector<NamedSurface> surfaces = chain.steps;
  surfaces.push_back(chain.designed);
  std::vector<const SurfaceField*> rowed;
  std::vector<const SurfaceField*> even;
  GridWindow coarse;
  for (const NamedSurface& surface : surfaces) {
    add_once(surface, surface.grid ? even : rowed);
    if (surface.grid) coarse = *surface.grid;
  }
  WaveOptions unscattered = options;
  unscattered.scatter.setZero();
  render(even, coarse, unscattered);
  render(rowed, setup.grid, options);
  return pictures;
}

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
  if (result.rays) {
    before = &result.rays->quality;
    add(leak_cause::kDiffraction, result.designed.quality, 0.0);
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

namespace {

void require_pixels(const Image& target, const OpticalSetup& optics) {
  LF_CHECK(target.columns() == optics.pixels.x() && target.rows() == optics.pixels.y(),
           std::to_string(target.columns()) + "x" + std::to_string(target.rows()));
}

FluxPicture with_haze(const Haze* haze, FluxPicture picture, const Executor& executor) {
  if (haze == nullptr) return picture;
  picture.flux = hazed(*haze, picture.flux, {picture.columns, picture.rows}, executor);
  return picture;
}

/// Adds the step of the haze, which is also on the part where that is among the other surfaces.
void add_haze(const LeakageChain& chain, const PictureJudge& judge, const Executor& executor,
              LeakageResult& result) {
  if (chain.haze == nullptr || chain.haze->none()) return;
  RenderedSurface part{
      leak_cause::kHaze, with_haze(chain.haze, result.part().picture, executor), {}};
  part.quality = judge.judge(part.picture);
  for (const NamedSurface& other : chain.others) {
    if (other.field != chain.part().field) continue;
    const auto shown = std::find_if(
        result.others.begin(), result.others.end(),
        [&other](const RenderedSurface& surface) { return surface.name == other.name; });
    if (shown == result.others.end()) continue;
    shown->picture = part.picture;
    shown->quality = part.quality;
  }
  result.steps.push_back(std::move(part));
  result.hazed = true;
}

/// Judges the pictures of a chain; other surfaces without a picture are left out.
LeakageResult judged(const LeakageChain& chain, const ChainPictures& pictures,
                     const PictureJudge& judge, const Executor& executor) {
  LeakageResult result;
  const auto rendered = [&](const NamedSurface& surface) {
    RenderedSurface one{surface.name, pictures.at(surface.field), {}};
    one.quality = judge.judge(one.picture);
    return one;
  };
  result.designed = rendered(chain.designed);
  for (const NamedSurface& step : chain.steps) result.steps.push_back(rendered(step));
  for (const NamedSurface& other : chain.others) {
    if (pictures.contains(other.field)) result.others.push_back(rendered(other));
  }
  add_haze(chain, judge, executor, result);
  result.dark = judge.dark();
  result.dark_pixels = judge.dark_pixels();
  result.bright_pixels = judge.bright_pixels();
  return result;
}

}  // namespace

LeakageResult measure_leakage(const LeakageChain& chain, const Image& target,
                              const FieldRenderSetup& setup, const LeakageOptions& options,
                              const Executor& executor, const RunControl& control) {
  validate(options);
  LF_CHECK(!chain.steps.empty(), chain.designed.name);
  require_pixels(target, setup.optics);
  const ChainPictures pictures = pictures_by_rays(chain, setup, executor, control);
  const FluxPicture& designed = pictures.at(chain.designed.field);
  const PictureJudge judge(target, designed, options);
  LeakageResult result = judged(chain, pictures, judge, executor);
  if (!setup.optics.extent.none()) {
    result.point = point_light(chain.designed, designed, setup, judge, executor, control);
  }
  result.parts = parts_of(result);
  return result;
}

LightChoice light_choice(const FieldRenderSetup& setup, LightModel asked, bool creases,
                         double wavelength) {
  if (creases) {
    return {false, "by rays: the part has creases, which a wave does not show as rays do"};
  }
  if (asked == LightModel::kRays) return {false, "by rays, as asked"};
  if (asked == LightModel::kWaves) return {true, "by waves, as asked"};
  const std::vector<PictureBlur> blurs =
      light_blurs(setup.optics, setup.surface_height, wavelength);
  if (waves_show(blurs)) return {true, "by waves"};
  return {false,
          joined({"by rays: the lamp's image is ", decimal_text(blurs[0].pixels, 1),
                  " pixels wide, and diffraction blurs ", decimal_text(blurs[1].pixels, 1)})};
}

WaveLeakage measure_waves(const LeakageChain& chain, const Image& target,
                          const FieldRenderSetup& setup, const LeakageOptions& options,
                          const Executor& executor, const RunControl& control) {
  validate(options);
  LF_CHECK(chain.waves.rays != nullptr, chain.designed.name);
  require_pixels(target, setup.optics);
  const double wavelength = chain.waves.wavelength;
  const WaveOptions waves = chain.waves.options().value();
  const ChainPictures pictures = pictures_by_waves(chain, setup, waves, executor, control);
  const FluxPicture& designed = pictures.at(chain.designed.field);
  const PictureJudge judge(target, designed, options);
  WaveLeakage measured{judged(chain, pictures, judge, executor), wavelength,
                       diffraction_width(setup.optics, setup.surface_height, wavelength)};
  measured.result.rays = *chain.waves.rays;
  measured.result.parts = parts_of(measured.result);
  return measured;
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

SamplingCheck check_sampling(const LeakageChain& chain, const LeakageResult& result,
                             const Image& target, const FieldRenderSetup& setup,
                             const Executor& executor, const RunControl& control) {
  const RunControl silent(control.stop_token(), {});
  FieldRenderSetup fine_setup = setup;
  fine_setup.grid = with_half_the_spacing(setup.grid);
  const std::vector<CellRange> windows = windows_of(setup);
  const auto with_fine_windows = [&](const SurfaceField& field, FluxPicture picture) {
    // A front is sampled as a whole, whatever it is rendered for.
    if (setup.back != nullptr) return render_field(field, fine_setup, executor, silent);
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
  const FluxPicture now = with_haze(
      chain.haze, with_fine_windows(*chain.part().field, result.clear_part().picture), executor);
  const FluxPicture& design_before = result.designed.picture;
  const FluxPicture design_now = with_fine_windows(*chain.designed.field, design_before);
  double cells = 0.0;
  for (const CellRange& window : windows) cells += area_of(window);
  const double scale = setup.back != nullptr ? 1.0 : area_of(all_cells(setup.grid)) / cells;
  return {setup.grid.spacing.minCoeff(),
          scale * (leakage_share(now, design_now) - leakage_share(before, design_before)),
          scale * (mae_of(now, target) - mae_of(before, target))};
}

namespace {

/// Weights of the pixels for deposit_adjoint(), with their sums from the right.
class PixelWeights {
 public:
  PixelWeights(std::span<const double> weights, int columns, int rows)
      : columns_(columns), rows_(rows), pixel_(weights.begin(), weights.end()) {
    const auto width = static_cast<std::size_t>(columns);
    suffix_.assign((width + 1) * static_cast<std::size_t>(rows), 0.0);
    for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r) {
      for (std::size_t c = width; c-- > 0;) {
        suffix_[r * (width + 1) + c] = suffix_[r * (width + 1) + c + 1] + pixel_[r * width + c];
      }
    }
  }

  /// Σ weight · flux over the pixels lit by a cell.
  [[nodiscard]] double gather(const SurfaceTile& tile, std::int64_t cell) const {
    const FluxCotangent view{pixel_.data(), suffix_.data(), columns_, rows_};
    double sum = 0.0;
    tile.visit_cell(cell, [&](const ImageTriangle& t) {
      if (t.flux != 0.0) sum += t.flux * deposit_adjoint(t, view).flux;
    });
    return sum;
  }

 private:
  int columns_;
  int rows_;
  std::vector<double> pixel_;
  std::vector<double> suffix_;
};

/// Weights of light before the blur of an extended source, from those of the pixels.
std::vector<double> in_parts(std::span<const double> weights, const SourceKernel& kernel,
                             const Eigen::Vector2i& pixels, const Executor& executor) {
  if (kernel.none()) return {weights.begin(), weights.end()};
  SourceBlurOn<Executor> blur(kernel, pixels.x(), pixels.y(), executor);
  std::copy(weights.begin(), weights.end(), blur.bar().begin());
  std::vector<double> parts(weights.size() * index_of(kernel.parts * kernel.parts));
  blur.apply_adjoint(executor, parts);
  return parts;
}

/// The two surfaces over one tile, and the map cells that lie in it.
struct TilePair {
  const SurfaceTile& designed;
  const SurfaceTile& part;
  const PixelWeights& weights;

  /// Fills one map cell from the grid cells of `box`, counted from the tile's least corner.
  void measure(const CellRange& box, double& leakage, HeightDifference& height) const {
    for (std::int64_t j = box.row; j < box.row + box.rows; ++j) {
      for (std::int64_t i = box.column; i < box.column + box.columns; ++i) {
        const std::int64_t cell = j * part.range().columns + i;
        if (!part.is_lit(cell)) continue;
        leakage += weights.gather(part, cell) - weights.gather(designed, cell);
        const double left = part.height(i, j) - designed.height(i, j);
        if (std::abs(left) > std::abs(height.value)) height = {left, part.place(i, j)};
      }
    }
  }
};

LeakMap empty_map(const GridWindow& grid, double cell) {
  LeakMap map;
  for (int axis = 0; axis < 2; ++axis) {
    map.grid_cells[axis] = std::max<std::int64_t>(1, std::llround(cell / grid.spacing[axis]));
  }
  map.columns = (grid.columns - 2) / map.grid_cells.x() + 1;
  map.rows = (grid.rows - 2) / map.grid_cells.y() + 1;
  map.leakage.assign(index_of(map.columns * map.rows), 0.0);
  map.height.resize(map.leakage.size());
  return map;
}

/// Sum of a square of cells around (column, row), as far as the map goes.
double square_sum(const LeakMap& map, const CellRange& square) {
  double sum = 0.0;
  for (std::int64_t r = square.row; r < square.row + square.rows; ++r) {
    for (std::int64_t c = square.column; c < square.column + square.columns; ++c) {
      sum += map.leakage[index_of(r * map.columns + c)];
    }
  }
  return sum;
}

/// True if two squares of one size are less than their side apart.
bool are_near(const CellRange& a, const CellRange& b) {
  return std::abs(a.column - b.column) < 2 * a.columns && std::abs(a.row - b.row) < 2 * a.rows;
}

/// All squares of span × span map cells (fewer on a small map) with their sums, worst first.
std::vector<std::pair<double, CellRange>> ranked_squares(const LeakMap& map, std::int64_t span) {
  const std::int64_t columns = std::min(span, map.columns);
  const std::int64_t rows = std::min(span, map.rows);
  std::vector<std::pair<double, CellRange>> squares;
  for (std::int64_t r = 0; r + rows <= map.rows; ++r) {
    for (std::int64_t c = 0; c + columns <= map.columns; ++c) {
      const CellRange square{c, r, columns, rows};
      squares.emplace_back(square_sum(map, square), square);
    }
  }
  std::stable_sort(squares.begin(), squares.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  return squares;
}

/// Worst squares that leak, apart from one another.
std::vector<CellRange> worst_squares(const LeakMap& map, const LeakPlaceOptions& options) {
  std::vector<CellRange> worst;
  for (const auto& [sum, square] : ranked_squares(map, std::max(1, options.span))) {
    if (sum <= 0.0 || std::ssize(worst) >= options.count) break;
    const auto meets = [&here = square](const CellRange& other) { return are_near(here, other); };
    if (std::none_of(worst.begin(), worst.end(), meets)) worst.push_back(square);
  }
  return worst;
}

/// The light of one square under every surface of the chain.
class PlaceStudy {
 public:
  PlaceStudy(const LeakageChain& chain, const LeakageResult& result, const FieldRenderSetup& setup,
             const Executor& executor)
      : chain_(chain),
        setup_(setup),
        executor_(executor),
        dark_(result.dark),
        more_(pixels_with_surplus(result.clear_part().picture, result.designed.picture)) {}

  LeakPlace study(const LeakMap& map, const CellRange& square) const {
    LeakPlace place;
    find_spot(map, square, place);
    const FluxPicture designed = render(chain_.designed, place.cells);
    FluxPicture before = designed;
    for (const NamedSurface& step : chain_.steps) {
      FluxPicture now = render(step, place.cells);
      place.parts.push_back(
          {step.name, difference(more_, now, before), difference(dark_, now, before), 0.0});
      before = std::move(now);
    }
    place.leakage = difference(more_, before, designed);
    place.dark_flux = difference(dark_, before, designed);
    place.lands = centre(before, designed);
    return place;
  }

 private:
  [[nodiscard]] FluxPicture render(const NamedSurface& surface, const CellRange& cells) const {
    return light_of_cells(*surface.field, setup_, cells, chain_.waves.options(), executor_,
                          RunControl());
  }

  /// Sets the square's place, and the middle and height of its worst cell.
  void find_spot(const LeakMap& map, const CellRange& square, LeakPlace& place) const {
    const GridWindow& grid = setup_.grid;
    const CellCounts& m = map.grid_cells;
    place.cells = {square.column * m.x(), square.row * m.y(), 0, 0};
    place.cells.columns = std::min(square.columns * m.x(), grid.columns - 1 - place.cells.column);
    place.cells.rows = std::min(square.rows * m.y(), grid.rows - 1 - place.cells.row);
    place.side = grid.spacing.x() * static_cast<double>(place.cells.columns);
    double most = 0.0;
    for (std::int64_t k = 0; k < square.columns * square.rows; ++k) {
      const std::int64_t column = square.column + k % square.columns;
      const std::int64_t row = square.row + k / square.columns;
      const std::size_t cell = index_of(row * map.columns + column);
      if (map.leakage[cell] <= most) continue;
      most = map.leakage[cell];
      place.height = map.height[cell];
      const Eigen::Vector2d middle = grid.node(column * m.x(), row * m.y()) +
                                     0.5 * m.cast<double>().cwiseProduct(grid.spacing);
      place.place = middle.cwiseMin(grid.node(grid.columns - 1, grid.rows - 1));
    }
  }

  static double difference(const std::vector<double>& weights, const FluxPicture& now,
                           const FluxPicture& before) {
    double sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      sum += weights[i] * (now.flux[i] - before.flux[i]);
    }
    return sum;
  }

  /// Centre of the light that lands in a surplus, contrary to the design.
  [[nodiscard]] Eigen::Vector2d centre(const FluxPicture& now, const FluxPicture& before) const {
    Eigen::Vector2d sum(0.0, 0.0);
    double all = 0.0;
    for (std::size_t i = 0; i < more_.size(); ++i) {
      const double extra = more_[i] * std::max(0.0, now.flux[i] - before.flux[i]);
      const std::size_t column = i % static_cast<std::size_t>(now.columns);
      const std::size_t row = i / static_cast<std::size_t>(now.columns);
      sum += extra * Eigen::Vector2d(static_cast<double>(column), static_cast<double>(row));
      all += extra;
    }
    return all > 0.0 ? Eigen::Vector2d((sum / all).array() + 0.5) : sum;
  }

  const LeakageChain& chain_;
  const FieldRenderSetup& setup_;
  const Executor& executor_;
  const std::vector<double>& dark_;
  std::vector<double> more_;
};

}  // namespace

double LeakMap::total() const { return std::accumulate(leakage.begin(), leakage.end(), 0.0); }

LeakMap map_leakage(const NamedSurface& designed, const NamedSurface& part,
                    const FieldRenderSetup& setup, std::span<const double> weights, double cell,
                    const Executor& executor) {
  const Eigen::Vector2i pixels = setup.optics.pixels;
  LF_CHECK(static_cast<std::int64_t>(weights.size()) ==
               static_cast<std::int64_t>(pixels.x()) * pixels.y(),
           std::to_string(weights.size()));
  const SourceKernel kernel = setup.blur();
  const OpticalSetup optics = setup.optics_in_parts(kernel);
  const std::vector<LightColor> colors = light_colors(optics);
  const std::size_t middle = colors.size() / 2;
  const PixelWeights pixel_weights(in_parts(weights, kernel, pixels, executor), optics.pixels.x(),
                                   optics.pixels.y());
  LeakMap map = empty_map(setup.grid, cell);
  const std::int64_t cells =
      std::max<std::int64_t>(1, setup.tile / map.grid_cells.maxCoeff());  // In a tile, each way.
  SurfaceTile designed_tile(colors[middle].setup, setup.grid, setup.whole_in(middle));
  SurfaceTile part_tile = designed_tile;
  for (const CellRange& range : tiles_of(all_cells(setup.grid), cells * map.grid_cells)) {
    designed_tile.load(*designed.field, range, executor);
    part_tile.load(*part.field, range, executor);
    const TilePair pair{designed_tile, part_tile, pixel_weights};
    // The tile's own cells, counted from its corner: every map cell lies in one tile.
    const std::vector<CellRange> boxes =
        tiles_of({0, 0, range.columns, range.rows}, map.grid_cells);
    parallel_for(
        executor, "map leakage", std::ssize(boxes),
        [&](std::int64_t b) {
          const CellRange& box = boxes[index_of(b)];
          const std::int64_t column = (range.column + box.column) / map.grid_cells.x();
          const std::int64_t row = (range.row + box.row) / map.grid_cells.y();
          const std::size_t place = index_of(row * map.columns + column);
          pair.measure(box, map.leakage[place], map.height[place]);
        },
        1);
  }
  return map;
}

std::vector<LeakPlace> worst_places(const LeakMap& map, const LeakageChain& chain,
                                    const LeakageResult& result, const FieldRenderSetup& setup,
                                    const LeakPlaceOptions& options, const Executor& executor) {
  const PlaceStudy study(chain, result, setup, executor);
  std::vector<LeakPlace> places;
  for (const CellRange& square : worst_squares(map, options)) {
    places.push_back(study.study(map, square));
  }
  // The map is of rays: waves may see another order, and no leak.
  std::erase_if(places, [](const LeakPlace& place) { return place.leakage <= 0.0; });
  std::stable_sort(places.begin(), places.end(),
                   [](const LeakPlace& a, const LeakPlace& b) { return a.leakage > b.leakage; });
  return places;
}

}  // namespace lensforge
