// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/field_tiles.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include "core/error.h"

namespace lensforge {

std::vector<GridWindow> cut_into_tiles(const GridWindow& grid, std::int64_t side) {
  LF_CHECK(side > 0 && grid.columns > 1 && grid.rows > 1, std::to_string(side));
  std::vector<GridWindow> tiles;
  for (std::int64_t row = 0; row + 1 < grid.rows; row += side) {
    for (std::int64_t column = 0; column + 1 < grid.columns; column += side) {
      GridWindow tile = grid;
      tile.first_column = grid.first_column + column;
      tile.first_row = grid.first_row + row;
      tile.columns = std::min(side + 1, grid.columns - column);
      tile.rows = std::min(side + 1, grid.rows - row);
      tiles.push_back(tile);
    }
  }
  return tiles;
}

bool for_each_tile(const SurfaceField& field, const GridWindow& grid, const Executor& executor,
                   const RunControl& control,
                   const std::function<void(const SurfacePatch&)>& visit) {
  const std::vector<GridWindow> tiles = cut_into_tiles(grid);
  SurfacePatch patch;
  double done = 0.0;
  for (const GridWindow& tile : tiles) {
    if (control.stop_requested()) return false;
    field.sample(tile, executor, patch);
    visit(patch);
    done += 1.0;
    control.report({"cam surface", done, static_cast<double>(tiles.size()), "tiles"});
  }
  return true;
}

SurfaceMesh mesh_of(const SurfacePatch& patch) {
  const GridWindow& window = patch.window;
  SurfaceMesh mesh;
  mesh.grid = {static_cast<int>(window.columns), static_cast<int>(window.rows)};
  mesh.vertices.resize(3, window.size());
  for (std::int64_t n = 0; n < window.size(); ++n) {
    mesh.vertices.col(n) << window.node(n % window.columns, n / window.columns),
        patch.z[static_cast<std::size_t>(n)];
  }
  mesh.triangles.resize(3, 2 * (window.columns - 1) * (window.rows - 1));
  std::int64_t t = 0;
  for (int row = 0; row + 1 < mesh.grid.rows; ++row) {
    for (int column = 0; column + 1 < mesh.grid.columns; ++column) {
      const int a = row * mesh.grid.columns + column;
      const int d = a + mesh.grid.columns;
      mesh.triangles.col(t++) << a, a + 1, d + 1;
      mesh.triangles.col(t++) << a, d + 1, d;
    }
  }
  return mesh;
}

}  // namespace lensforge
