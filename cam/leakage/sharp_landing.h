// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lensforge {

/// Whether a node of a grid has neighbours on both sides along x and along y.
struct InnerNode {
  bool column = true;
  bool row = true;
};

/// Where a node's beam is to land so that beams between the nodes, which land linear between
/// theirs, do right on average over the triangles: v − Δ/24, Δ being the sum of the second
/// differences along the three directions of the triangles' edges. Its own place where a neighbour
/// has none.
/// @param columns  of the grid, row by row.
inline Eigen::Vector2d sharp_landing(const std::vector<Eigen::Vector2d>& landing, std::size_t node,
                                     std::int64_t columns, InnerNode inner = {}) {
  Eigen::Vector2d bends = Eigen::Vector2d::Zero();
  const auto add = [&](std::int64_t step) {
    const auto offset = static_cast<std::size_t>(step);
    bends += landing[node - offset] - 2.0 * landing[node] + landing[node + offset];
  };
  if (inner.column) add(1);
  if (inner.row) add(columns);
  if (inner.column && inner.row) add(columns + 1);
  if (!bends.allFinite()) return landing[node];
  return landing[node] - bends / 24.0;
}

}  // namespace lensforge
