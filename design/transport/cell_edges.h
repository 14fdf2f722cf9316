// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "design/transport/power_diagram.h"

namespace lensforge {

/// A cell's place at one of its edges.
struct CellSide {
  std::int32_t code;       ///< The edge's number; its complement if the cell is on the right.
  std::int32_t neighbour;  ///< The cell on the other side.

  [[nodiscard]] LF_HD bool on_left() const { return code >= 0; }
  [[nodiscard]] LF_HD std::int32_t edge() const { return code >= 0 ? code : ~code; }
};

/// The edges of a power diagram, and which cell has which: all that a device must know of it.
struct CellEdges {
  std::vector<DualEdge> edges;
  /// Cell i's sides are numbers first[i] … first[i + 1] − 1, in the order of the edges.
  std::vector<std::int32_t> first;
  std::vector<CellSide> sides;
  /// The cell at the right border's far end, (columns, rows): Green's theorem leaves that border
  /// out, and what a cell has of it shows only where edges cross it.
  int corner = 0;
};

/// Edges for measuring under densities of columns × rows pixels.
CellEdges cell_edges(const PowerDiagram& diagram, int columns, int rows, const Executor& executor);

/// Where an edge leaves (+1) or enters (−1) the half-plane left of the picture's right border.
struct BorderCrossing {
  int direction = 0;
  double y = 0.0;
};

/// Ends on the border count as outside, so that the edges that share an end agree.
LF_HD inline BorderCrossing right_crossing(const DualEdge& edge, double columns) {
  const bool from_inside = edge.from.x() < columns;
  const bool to_inside = edge.to.x() < columns;
  if (from_inside == to_inside) return {};
  const double share = (columns - edge.from.x()) / (edge.to.x() - edge.from.x());
  return {from_inside ? 1 : -1, edge.from.y() + share * (edge.to.y() - edge.from.y())};
}

}  // namespace lensforge
