// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/crease_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "core/error.h"

namespace lensforge {

CreaseMapper::CreaseMapper(const GridWindow& grid, const CreaseMapOptions& options)
    : options_(options), grid_(grid) {
  LF_CHECK(options.cell > 0.0, std::to_string(options.cell));
  const Eigen::Vector2d size = grid.node(grid.columns - 1, grid.rows - 1) - grid.node(0, 0);
  const auto parts = [&](double side) {
    return std::max<std::int64_t>(1, std::llround(std::ceil(side / options.cell - 1e-9)));
  };
  columns_ = parts(size.x());
  rows_ = parts(size.y());
  cells_.resize(static_cast<std::size_t>(columns_ * rows_));
}

std::int64_t CreaseMapper::cell_at(double at, int axis) const {
  const auto cell = static_cast<std::int64_t>((at - grid_.node(0, 0)[axis]) / options_.cell);
  return std::min(cell, (axis == 0 ? columns_ : rows_) - 1);
}

/// Tiles share their rims: the first row and column count only where the grid begins. Rows of the
/// map are filled at once, each by one thread.
void CreaseMapper::add(const CellRange& tile, const SurfacePatch& patch, const Executor& executor) {
  const GridWindow& window = patch.window;
  // The tile's first node, counted in the patch.
  const std::int64_t column = grid_.first_column + tile.column - window.first_column;
  const std::int64_t row = grid_.first_row + tile.row - window.first_row;
  const std::int64_t column_begin = column + (tile.column > 0 ? 1 : 0);
  const std::int64_t row_begin = row + (tile.row > 0 ? 1 : 0);
  std::vector<std::pair<std::int64_t, std::int64_t>> bands;
  for (std::int64_t j = row_begin; j <= row + tile.rows; ++j) {
    const bool same = !bands.empty() && cell_at(window.y(j), 1) == cell_at(window.y(j - 1), 1);
    if (!same) bands.emplace_back(j, j);
    ++bands.back().second;
  }
  parallel_for(executor, "crease map", std::ssize(bands), [&](std::int64_t b) {
    const auto [first, last] = bands[static_cast<std::size_t>(b)];
    for (std::int64_t j = first; j < last; ++j)
      add_row(patch, j, column_begin, column + tile.columns + 1);
  });
}

void CreaseMapper::add_row(const SurfacePatch& patch, std::int64_t row, std::int64_t begin,
                           std::int64_t end) {
  const GridWindow& window = patch.window;
  const std::int64_t cell_row = cell_at(window.y(row), 1);
  for (std::int64_t i = begin; i < end; ++i) {
    const auto n = static_cast<std::size_t>(row * window.columns + i);
    Cell& cell = cells_[static_cast<std::size_t>(cell_row * columns_ + cell_at(window.x(i), 0))];
    ++cell.nodes;
    if (!(patch.depth[n] > 0.0)) continue;
    ++cell.fillets;
    if (patch.depth[n] <= cell.deepest.depth) continue;
    cell.deepest = {window.node(i, row), patch.depth[n], patch.width[n]};
  }
}

CreaseMap CreaseMapper::map() const {
  CreaseMap map;
  map.columns = columns_;
  map.rows = rows_;
  map.cell = options_.cell;
  map.origin = grid_.node(0, 0);
  std::int64_t nodes = 0;
  std::int64_t fillets = 0;
  for (const Cell& cell : cells_) {
    nodes += cell.nodes;
    fillets += cell.fillets;
    map.depth.push_back(static_cast<float>(cell.deepest.depth));
    map.share.push_back(
        cell.nodes > 0 ? static_cast<float>(cell.fillets) / static_cast<float>(cell.nodes) : 0.0F);
  }
  map.fillets = nodes > 0 ? static_cast<double>(fillets) / static_cast<double>(nodes) : 0.0;
  map.worst = worst();
  return map;
}

/// Deepest spots first, none near another.
std::vector<CreaseSpot> CreaseMapper::worst() const {
  std::vector<CreaseSpot> spots;
  for (const Cell& cell : cells_) {
    if (cell.deepest.depth > 0.0) spots.push_back(cell.deepest);
  }
  std::stable_sort(spots.begin(), spots.end(),
                   [](const CreaseSpot& a, const CreaseSpot& b) { return a.depth > b.depth; });
  std::vector<CreaseSpot> worst;
  for (const CreaseSpot& spot : spots) {
    if (worst.size() == options_.spots) break;
    const bool crowded = std::any_of(worst.begin(), worst.end(), [&](const CreaseSpot& other) {
      return (spot.place - other.place).norm() < options_.apart;
    });
    if (!crowded) worst.push_back(spot);
  }
  return worst;
}

}  // namespace lensforge
