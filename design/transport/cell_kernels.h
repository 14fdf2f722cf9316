// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "core/compute/host_device.h"
#include "design/flux/flux_triangle.h"
#include "design/transport/cell_edges.h"
#include "design/transport/summed_density.h"

/// What one edge of a power diagram contributes to its two cells, and one cell's sum of that. An
/// edge is walked through the pixels that it crosses; no cell is ever cut with a pixel. Every cell
/// adds up its own edges, in their order: the same bits whoever does it.
namespace lensforge {

/// An edge's contribution to the cell on its left, that of the right gets the opposite; and what
/// its length couples. As it is walked, `coupling` is ∫ρ dℓ and `even_coupling` ∫dℓ.
struct EdgeMeasure {
  double mass = 0.0;
  double area = 0.0;
  double coupling = 0.0;  ///< −∂mass_left/∂w_right = ∫ρ dℓ / (2 |c_left − c_right|).
  double even_coupling = 0.0;  ///< The same for a density of 1.

  LF_HD void add_piece(const DensityPixel& pixel, const EdgePiece& piece) {
    const double dx = piece.x1 - piece.x0;
    const double dy = piece.y1 - piece.y0;
    const double middle = 0.5 * (piece.x0 + piece.x1) - piece.column;
    mass += dy * (pixel.mass + pixel.value * middle);
    area += dy * (piece.column + middle);
    const double piece_length = std::sqrt(dx * dx + dy * dy);
    even_coupling += piece_length;
    coupling += pixel.value * piece_length;
  }
  LF_HD void add_border(const DensityView& density, double y, double sign) {
    mass += sign * density.right_border(y).mass;
    area += sign * density.columns * y;
  }
};

struct EdgeMoments {
  Moments moments;

  /// F ρ-integrals at x within the pixel, times dy; two Gauss points are exact for these cubics.
  LF_HD void add_piece(const DensityPixel& pixel, const EdgePiece& piece) {
    const double half = 0.5 * (piece.y1 - piece.y0);
    constexpr double kGauss = 0.57735026918962576451;
    for (const double node : {-kGauss, kGauss}) {
      const double share = 0.5 * (1.0 + node);
      const double x = piece.x0 + share * (piece.x1 - piece.x0);
      const double y = piece.y0 + share * (piece.y1 - piece.y0);
      const double c = piece.column;
      const double mass = pixel.mass + pixel.value * (x - c);
      const double first = pixel.first + 0.5 * pixel.value * (x - c) * (x + c);
      const double second =
          pixel.second + pixel.value * (x - c) * (x * x + x * c + c * c) * (1.0 / 3.0);
      moments += {half * mass, half * first, half * mass * y, half * (second + mass * y * y)};
    }
  }
  LF_HD void add_border(const DensityView& density, double y, double sign) {
    const Moments border = density.right_border(y);
    if (sign > 0.0) {
      moments += border;
    } else {
      moments -= border;
    }
  }
};

template <class Contribution>
LF_HD Contribution walk_cell_edge(const DualEdge& edge, const DensityView& density) {
  Contribution sum;
  const double columns = density.columns;
  if (edge.from.x() >= columns && edge.to.x() >= columns) return sum;
  walk_edge(edge.from, edge.to, density.columns, density.rows, [&](const EdgePiece& piece) {
    if (piece.column >= 0) sum.add_piece(density.pixel(piece.column, piece.row), piece);
  });
  // The cell on the left of an edge that leaves begins there on the border, its neighbour ends.
  const BorderCrossing crossing = right_crossing(edge, columns);
  if (crossing.direction != 0 && crossing.y >= 0.0 && crossing.y < density.rows) {
    sum.add_border(density, crossing.y, -crossing.direction);
  }
  return sum;
}

/// A power diagram and its density in the memory of an executor.
struct CellView {
  const double* sites;  ///< 2 × cells
  const DualEdge* edges;
  const std::int32_t* first;
  const CellSide* sides;
  int corner;
  DensityView density;
};

struct MeasureEdge {
  CellView cells;
  EdgeMeasure* out;

  LF_HD void operator()(std::int64_t e) const {
    const DualEdge& edge = cells.edges[e];
    auto sum = walk_cell_edge<EdgeMeasure>(edge, cells.density);
    if (sum.even_coupling > 0.0) {
      const double* left = cells.sites + 2 * static_cast<std::int64_t>(edge.left);
      const double* right = cells.sites + 2 * static_cast<std::int64_t>(edge.right);
      const double dx = left[0] - right[0];
      const double dy = left[1] - right[1];
      const double scale = 0.5 / std::sqrt(dx * dx + dy * dy);
      sum.coupling *= scale;
      sum.even_coupling *= scale;
    }
    out[e] = sum;
  }
};

struct MeasureCell {
  CellView cells;
  const EdgeMeasure* edges;
  double* mass;
  double* area;

  LF_HD void operator()(std::int64_t i) const {
    const bool corner = i == cells.corner;
    double mass_sum = corner ? cells.density.total() : 0.0;
    double area_sum =
        corner ? static_cast<double>(cells.density.columns) * cells.density.rows : 0.0;
    for (std::int32_t k = cells.first[i]; k < cells.first[i + 1]; ++k) {
      const CellSide side = cells.sides[k];
      const EdgeMeasure& edge = edges[side.edge()];
      mass_sum += side.on_left() ? edge.mass : -edge.mass;
      area_sum += side.on_left() ? edge.area : -edge.area;
    }
    mass[i] = mass_sum;
    area[i] = area_sum;
  }
};

struct FindEdgeMoments {
  CellView cells;
  EdgeMoments* out;

  LF_HD void operator()(std::int64_t e) const {
    out[e] = walk_cell_edge<EdgeMoments>(cells.edges[e], cells.density);
  }
};

struct FindCellMoments {
  CellView cells;
  const EdgeMoments* edges;
  Moments* out;

  LF_HD void operator()(std::int64_t i) const {
    Moments sum;
    if (i == cells.corner) sum += cells.density.right_border(cells.density.rows);
    for (std::int32_t k = cells.first[i]; k < cells.first[i + 1]; ++k) {
      const CellSide side = cells.sides[k];
      const Moments& edge = edges[side.edge()].moments;
      if (side.on_left()) {
        sum += edge;
      } else {
        sum -= edge;
      }
    }
    out[i] = sum;
  }
};

}  // namespace lensforge
