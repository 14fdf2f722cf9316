// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "cam/milled/lens_grid.h"
#include "cam/milled/surface_field.h"
#include "core/compute/executor.h"

namespace lensforge {

/// A place that the ball cannot reach.
struct CreaseSpot {
  Eigen::Vector2d place{0.0, 0.0};  ///< mm
  double depth = 0.0;  ///< Left standing above the designed surface, mm; the most in its cell.
  double width = 0.0;  ///< Of the fillet there, mm.
};

/// How a crease map is drawn.
struct CreaseMapOptions {
  double cell = 0.5;       ///< Side of the map's cells, mm, > 0.
  std::size_t spots = 20;  ///< Worst places listed at most.
  double apart = 3.0;      ///< Least distance of two of them, mm.
};

/// Where concave creases keep material, over the whole lens.
struct CreaseMap {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  double cell = 0.0;                 ///< mm
  Eigen::Vector2d origin{0.0, 0.0};  ///< Least corner of the first cell, mm.
  std::vector<float> depth;          ///< Deepest in each cell, mm, row by row from the least y.
  std::vector<float> share;          ///< Of each cell's nodes that lie in a fillet.
  double fillets = 0.0;              ///< Share of all nodes: of the light that is concerned.
  std::vector<CreaseSpot> worst;     ///< Deepest first.
};

/// Draws the map of a grid from the tiles that a rounded surface is sampled in.
class CreaseMapper {
 public:
  /// @pre options.cell > 0.
  CreaseMapper(const GridWindow& grid, const CreaseMapOptions& options);

  /// Takes the nodes of a tile of the grid; tiles must not overlap, but for their rims.
  /// @param patch  with depth and width; may reach beyond the tile.
  void add(const CellRange& tile, const SurfacePatch& patch, const Executor& executor);

  [[nodiscard]] CreaseMap map() const;

 private:
  /// What is known of a cell while tiles come in.
  struct Cell {
    CreaseSpot deepest;
    std::int64_t nodes = 0;
    std::int64_t fillets = 0;
  };
  /// Cell that a coordinate lies in, along an axis.
  [[nodiscard]] std::int64_t cell_at(double at, int axis) const;
  void add_row(const SurfacePatch& patch, std::int64_t row, std::int64_t begin, std::int64_t end);
  [[nodiscard]] std::vector<CreaseSpot> worst() const;

  CreaseMapOptions options_;
  GridWindow grid_;
  std::int64_t columns_ = 0;
  std::int64_t rows_ = 0;
  std::vector<Cell> cells_;
};

}  // namespace lensforge
