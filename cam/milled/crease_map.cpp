// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/crease_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "cam/milled/lens_grid.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// Cells along a tile's side.
constexpr std::int64_t kTileSide = 1024;

/// What is known of a cell while tiles come in.
struct Cell {
  CreaseSpot deepest;
  std::int64_t nodes = 0;
  std::int64_t fillets = 0;
};

class MapBuilder {
 public:
  MapBuilder(const GridWindow& grid, double cell) {
    map.cell = cell;
    map.origin = grid.node(0, 0);
    const Eigen::Vector2d size = grid.node(grid.columns - 1, grid.rows - 1) - map.origin;
    map.columns = std::max<std::int64_t>(1, std::llround(std::ceil(size.x() / cell - 1e-9)));
    map.rows = std::max<std::int64_t>(1, std::llround(std::ceil(size.y() / cell - 1e-9)));
    cells_.resize(static_cast<std::size_t>(map.columns * map.rows));
  }

  /// Tiles share their rims: the first row and column count only where the grid begins.
  void add(const SurfacePatch& patch, const CreasePatch& creases, bool first_column,
           bool first_row) {
    const GridWindow& window = patch.window;
    for (std::int64_t j = first_row ? 0 : 1; j < window.rows; ++j) {
      for (std::int64_t i = first_column ? 0 : 1; i < window.columns; ++i) {
        const auto n = static_cast<std::size_t>(j * window.columns + i);
        Cell& cell = cell_at(window.node(i, j));
        ++cell.nodes;
        if (!(creases.depth[n] > 0.0)) continue;
        ++cell.fillets;
        if (creases.depth[n] <= cell.deepest.depth) continue;
        cell.deepest = {window.node(i, j), creases.depth[n], creases.width[n]};
      }
    }
  }

  CreaseMap finish(const CreaseMapOptions& options) {
    std::int64_t nodes = 0;
    std::int64_t fillets = 0;
    for (const Cell& cell : cells_) {
      nodes += cell.nodes;
      fillets += cell.fillets;
      map.depth.push_back(static_cast<float>(cell.deepest.depth));
      map.share.push_back(cell.nodes > 0
                              ? static_cast<float>(cell.fillets) / static_cast<float>(cell.nodes)
                              : 0.0F);
    }
    map.fillets = nodes > 0 ? static_cast<double>(fillets) / static_cast<double>(nodes) : 0.0;
    list_worst(options);
    return map;
  }

  CreaseMap map;

 private:
  Cell& cell_at(const Eigen::Vector2d& place) {
    const Eigen::Vector2d at = (place - map.origin) / map.cell;
    const auto column = std::min(static_cast<std::int64_t>(at.x()), map.columns - 1);
    const auto row = std::min(static_cast<std::int64_t>(at.y()), map.rows - 1);
    return cells_[static_cast<std::size_t>(row * map.columns + column)];
  }

  void list_worst(const CreaseMapOptions& options) {
    std::vector<CreaseSpot> spots;
    for (const Cell& cell : cells_) {
      if (cell.deepest.depth > 0.0) spots.push_back(cell.deepest);
    }
    std::stable_sort(spots.begin(), spots.end(),
                     [](const CreaseSpot& a, const CreaseSpot& b) { return a.depth > b.depth; });
    for (const CreaseSpot& spot : spots) {
      if (map.worst.size() == options.spots) return;
      const bool crowded =
          std::any_of(map.worst.begin(), map.worst.end(), [&](const CreaseSpot& other) {
            return (spot.place - other.place).norm() < options.apart;
          });
      if (!crowded) map.worst.push_back(spot);
    }
  }

  std::vector<Cell> cells_;
};

}  // namespace

CreaseMap map_creases(const RoundedField& field, const GridWindow& grid,
                      const CreaseMapOptions& options, const Executor& executor,
                      const RunControl& control) {
  LF_CHECK(options.cell > 0.0, std::to_string(options.cell));
  MapBuilder builder(grid, options.cell);
  const std::vector<CellRange> tiles = tiles_of(all_cells(grid), kTileSide);
  SurfacePatch patch;
  CreasePatch creases;
  double done = 0.0;
  for (const CellRange& cells : tiles) {
    if (control.stop_requested()) return builder.finish(options);
    const GridWindow tile = window_of(grid, cells, 0);
    field.sample(tile, executor, patch, creases);
    builder.add(patch, creases, tile.first_column == grid.first_column,
                tile.first_row == grid.first_row);
    done += 1.0;
    control.report({"cam creases", done, static_cast<double>(tiles.size()), "tiles"});
  }
  builder.map.complete = true;
  return builder.finish(options);
}

}  // namespace lensforge
