// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/cell_edges.h"

#include <algorithm>
#include <cstddef>

namespace lensforge {

namespace {

/// Rays are cut this many extents of picture and sites away from it.
constexpr double kReach = 16.0;

int corner_cell(const PowerDiagram& diagram, const std::vector<DualEdge>& edges, int columns,
                int rows) {
  int site = -1;
  double highest = -1.0;
  for (const DualEdge& edge : edges) {
    const BorderCrossing crossing = right_crossing(edge, columns);
    if (crossing.direction == 0 || crossing.y < 0.0 || crossing.y >= rows) continue;
    if (crossing.y > highest) {
      highest = crossing.y;
      site = crossing.direction > 0 ? edge.left : edge.right;
    }
  }
  // Where no edge crosses the border one cell holds all of it: its middle is the safest place.
  return site >= 0 ? site : diagram.owner({columns, 0.5 * rows});
}

/// Sorts the edges' ends by cell.
void find_sides(std::size_t cells, CellEdges& result) {
  result.first.assign(cells + 1, 0);
  for (const DualEdge& e : result.edges) {
    ++result.first[static_cast<std::size_t>(e.left) + 1];
    ++result.first[static_cast<std::size_t>(e.right) + 1];
  }
  for (std::size_t i = 0; i < cells; ++i) result.first[i + 1] += result.first[i];
  result.sides.resize(2 * result.edges.size());
  std::vector<std::int32_t> next(result.first.begin(), result.first.end() - 1);
  const auto place = [&](int cell) -> CellSide& {
    return result.sides[static_cast<std::size_t>(next[static_cast<std::size_t>(cell)]++)];
  };
  std::int32_t number = 0;
  for (const DualEdge& e : result.edges) {
    place(e.left) = {number, e.right};
    place(e.right) = {~number, e.left};
    ++number;
  }
}

}  // namespace

CellEdges cell_edges(const PowerDiagram& diagram, int columns, int rows, const Executor& executor) {
  const Eigen::Matrix2Xd& sites = diagram.sites();
  const double extent = std::max({sites.cwiseAbs().maxCoeff(), 1.0 * columns, 1.0 * rows});
  CellEdges result;
  result.edges = diagram.dual_edges(kReach * extent, executor);
  result.corner = corner_cell(diagram, result.edges, columns, rows);
  find_sides(static_cast<std::size_t>(sites.cols()), result);
  return result;
}

}  // namespace lensforge
