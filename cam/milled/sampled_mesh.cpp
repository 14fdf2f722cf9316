// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/sampled_mesh.h"

#include <cstddef>
#include <cstdint>

namespace lensforge {

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
