// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/sampled_mesh.h"

#include <cstddef>
#include <cstdint>

#include "core/surface/grid_triangles.h"

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
  mesh.triangles = grid_triangles(mesh.grid);
  return mesh;
}

}  // namespace lensforge
