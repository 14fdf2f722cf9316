// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/mesh/surface_mesh.h"

namespace lensforge::testing {

/// A grid of columns × rows vertices, `step` mm apart, z = height everywhere, two triangles a cell.
inline SurfaceMesh grid_mesh(int columns, int rows, double step = 1.0, double height = 5.0) {
  SurfaceMesh mesh;
  mesh.grid = {columns, rows};
  mesh.vertices.resize(3, Eigen::Index{columns} * rows);
  for (int v = 0; v < columns * rows; ++v) {
    const int column = v % columns;
    const int row = v / columns;
    mesh.vertices.col(v) << step * column, step * row, height;
  }
  mesh.triangles.resize(3, Eigen::Index{2} * (columns - 1) * (rows - 1));
  Eigen::Index t = 0;
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const int v = row * columns + column;
      mesh.triangles.col(t++) << v, v + 1, v + columns + 1;
      mesh.triangles.col(t++) << v, v + columns + 1, v + columns;
    }
  }
  return mesh;
}

}  // namespace lensforge::testing
