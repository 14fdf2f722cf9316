// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "cam/milled/surface_field.h"

namespace lensforge {

/// The grid over a lens's rectangle from (0, 0) whose nodes are at most `spacing` apart, mm, the
/// last ones on the rim and none beyond.
/// @throw InputError unless both sides are positive, at most 1 m, and the spacing is from 0.1 µm
/// up.
GridWindow lens_grid(const Eigen::Vector2d& size, double spacing);

/// The same with a spacing of its own along x and y.
GridWindow lens_grid(const Eigen::Vector2d& size, const Eigen::Vector2d& spacing);

/// A rectangle of cells of a grid; cell (i, j) lies between nodes (i, j) and (i + 1, j + 1).
struct CellRange {
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::int64_t columns = 0;
  std::int64_t rows = 0;
};

/// The part of a grid that holds a range's nodes and `halo` more on every side, as far as there
/// are.
GridWindow window_of(const GridWindow& grid, const CellRange& range, std::int64_t halo);

/// Every cell of a grid.
CellRange all_cells(const GridWindow& grid);

/// Cells along x and y.
using CellCounts = Eigen::Matrix<std::int64_t, 2, 1>;

/// Cuts a range into tiles of at most `sides` cells, row by row. @pre sides > 0.
std::vector<CellRange> tiles_of(const CellRange& range, const CellCounts& sides);
std::vector<CellRange> tiles_of(const CellRange& range, std::int64_t side);

}  // namespace lensforge
