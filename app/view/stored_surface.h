// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/surface/sampled_surface.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// One number of every vertex, as PackedNumbers.
struct StoredChannel {
  std::string name;  ///< "x", "y", "z", "slope_x", "slope_y"
  int bytes = 0;     ///< Of each number; 0 if all are `low`.
  double low = 0.0;
  double high = 0.0;
  std::string text;  ///< Base 64.

  /// Between two neighbouring numbers, in the channel's unit.
  [[nodiscard]] double step() const;
};

/// A surface as a page has it: in numbers of a few bytes.
///
/// On a grid x and y are counted from where an even grid over the lens has the vertex, so that 16
/// bits reach far below a micrometre.
struct StoredSurface {
  GridShape grid;  ///< {0, 0} if it is none.
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  std::vector<StoredChannel> channels;
  /// Vertex numbers of the triangles, 32 bits each, base 64; empty if they follow from the grid.
  std::string corners;
  bool zigzag = false;       ///< Their diagonals turn from row to row (make_grid_mesh()).
  SampledSurface read_back;  ///< What a page reads of it; without normals if it has no slopes.

  [[nodiscard]] const StoredChannel* channel(const std::string& name) const;
};

/// @param normals  3 × V with z > 0, of any length; without columns the triangles' own count.
StoredSurface store_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const Eigen::Vector2d& lens_size);

}  // namespace lensforge
