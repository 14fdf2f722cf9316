// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/leak_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "cam/contact/index_of.h"
#include "cam/leakage/surface_tile.h"
#include "core/error.h"
#include "core/optics/optical_setup.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {
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
    const auto meets = [&square = square](const CellRange& other) {
      return are_near(square, other);
    };
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
        more_(pixels_with_surplus(result.part().picture, result.designed.picture)) {}

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
    return render_cells(*surface.field, setup_, cells, executor_, RunControl());
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
  return places;
}

}  // namespace lensforge
