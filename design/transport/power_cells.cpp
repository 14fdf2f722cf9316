// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_cells.h"

#include <algorithm>
#include <cmath>

#include "design/flux/edge_walk.h"

namespace lensforge {

namespace {

/// An edge's contribution to the cell on its left; that of the right gets the opposite.
struct MassContribution {
  double mass = 0.0;
  double area = 0.0;
  double weighted_length = 0.0;  ///< ∫ρ dℓ
  double length = 0.0;

  void add_piece(const SummedDensity::Pixel& pixel, const EdgePiece& piece) {
    const double dx = piece.x1 - piece.x0;
    const double dy = piece.y1 - piece.y0;
    const double middle = 0.5 * (piece.x0 + piece.x1) - piece.column;
    mass += dy * (pixel.mass + pixel.value * middle);
    area += dy * (piece.column + middle);
    const double piece_length = std::sqrt(dx * dx + dy * dy);
    length += piece_length;
    weighted_length += pixel.value * piece_length;
  }
  void add_border(const SummedDensity& density, double y, double sign) {
    mass += sign * density.right_border(y).mass;
    area += sign * density.columns() * y;
  }
};

struct MomentContribution {
  Moments moments;

  /// F ρ-integrals at x within the pixel, times dy; two Gauss points are exact for these cubics.
  void add_piece(const SummedDensity::Pixel& pixel, const EdgePiece& piece) {
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
  void add_border(const SummedDensity& density, double y, double sign) {
    const Moments border = density.right_border(y);
    if (sign > 0.0) {
      moments += border;
    } else {
      moments -= border;
    }
  }
};

/// Where an edge leaves (+1) or enters (−1) the half-plane left of the picture's right border.
struct Crossing {
  int direction = 0;
  double y = 0.0;
};

/// Ends on the border count as outside, so that the edges that share an end agree.
Crossing right_crossing(const DualEdge& edge, double columns) {
  const bool from_inside = edge.from.x() < columns;
  const bool to_inside = edge.to.x() < columns;
  if (from_inside == to_inside) return {};
  const double share = (columns - edge.from.x()) / (edge.to.x() - edge.from.x());
  return {from_inside ? 1 : -1, edge.from.y() + share * (edge.to.y() - edge.from.y())};
}

template <class Contribution>
Contribution walk(const DualEdge& edge, const SummedDensity& density) {
  Contribution sum;
  const double columns = density.columns();
  if (edge.from.x() >= columns && edge.to.x() >= columns) return sum;
  walk_edge(edge.from, edge.to, density.columns(), density.rows(), [&](const EdgePiece& piece) {
    if (piece.column >= 0) sum.add_piece(density.pixel(piece.column, piece.row), piece);
  });
  // The cell on the left of an edge that leaves begins there on the border, its neighbour ends.
  const Crossing crossing = right_crossing(edge, columns);
  if (crossing.direction != 0 && crossing.y >= 0.0 && crossing.y < density.rows()) {
    sum.add_border(density, crossing.y, -crossing.direction);
  }
  return sum;
}

/// The site whose cell holds the right border's far end (columns, rows).
int corner_site(const PowerDiagram& diagram, const std::vector<DualEdge>& edges,
                const SummedDensity& density) {
  int site = -1;
  double highest = -1.0;
  for (const DualEdge& edge : edges) {
    const Crossing crossing = right_crossing(edge, density.columns());
    if (crossing.direction == 0 || crossing.y < 0.0 || crossing.y >= density.rows()) continue;
    if (crossing.y > highest) {
      highest = crossing.y;
      site = crossing.direction > 0 ? edge.left : edge.right;
    }
  }
  // Where no edge crosses the border one cell holds all of it: its middle is the safest place.
  return site >= 0 ? site : diagram.owner({density.columns(), 0.5 * density.rows()});
}

template <class Contribution>
std::vector<Contribution> walk_all(const std::vector<DualEdge>& edges, const SummedDensity& density,
                                   const Executor& executor) {
  std::vector<Contribution> sums(edges.size());
  parallel_for(executor, "power cells", static_cast<std::int64_t>(edges.size()),
               [&](std::int64_t e) {
                 const auto k = static_cast<std::size_t>(e);
                 sums[k] = walk<Contribution>(edges[k], density);
               });
  return sums;
}

/// Rays are cut this many extents of picture and sites away from it.
constexpr double kReach = 16.0;

std::vector<DualEdge> edges_near(const PowerDiagram& diagram, const SummedDensity& density,
                                 const Executor& executor) {
  const Eigen::Matrix2Xd& sites = diagram.sites();
  const double extent =
      std::max({sites.cwiseAbs().maxCoeff(), 1.0 * density.columns(), 1.0 * density.rows()});
  return diagram.dual_edges(kReach * extent, executor);
}

}  // namespace

PowerCells measure_cells(const PowerDiagram& diagram, const SummedDensity& density,
                         const Executor& executor) {
  const Eigen::Matrix2Xd& sites = diagram.sites();
  const std::vector<DualEdge> edges = edges_near(diagram, density, executor);
  const auto sums = walk_all<MassContribution>(edges, density, executor);
  PowerCells cells;
  cells.mass.resize(static_cast<std::size_t>(sites.cols()));
  cells.area.resize(static_cast<std::size_t>(sites.cols()));
  cells.borders.reserve(edges.size());
  const auto corner = static_cast<std::size_t>(corner_site(diagram, edges, density));
  cells.mass[corner] += density.total();
  cells.area[corner] += static_cast<double>(density.columns()) * density.rows();
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto left = static_cast<std::size_t>(edges[e].left);
    const auto right = static_cast<std::size_t>(edges[e].right);
    cells.mass[left] += sums[e].mass;
    cells.mass[right] -= sums[e].mass;
    cells.area[left] += sums[e].area;
    cells.area[right] -= sums[e].area;
    if (!(sums[e].length > 0.0)) continue;
    const double scale = 0.5 / (sites.col(edges[e].left) - sites.col(edges[e].right)).norm();
    cells.borders.push_back(
        {edges[e].left, edges[e].right, scale * sums[e].weighted_length, scale * sums[e].length});
  }
  return cells;
}

std::vector<Moments> cell_moments(const PowerDiagram& diagram, const SummedDensity& density,
                                  const Executor& executor) {
  const std::vector<DualEdge> edges = edges_near(diagram, density, executor);
  const auto sums = walk_all<MomentContribution>(edges, density, executor);
  std::vector<Moments> cells(static_cast<std::size_t>(diagram.sites().cols()));
  cells[static_cast<std::size_t>(corner_site(diagram, edges, density))] +=
      density.right_border(density.rows());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    cells[static_cast<std::size_t>(edges[e].left)] += sums[e].moments;
    cells[static_cast<std::size_t>(edges[e].right)] -= sums[e].moments;
  }
  return cells;
}

double transport_energy(const PowerDiagram& diagram, const std::vector<Moments>& cells,
                        const Eigen::VectorXd& wanted) {
  double energy = 0.0;
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    const Moments& m = cells[static_cast<std::size_t>(i)];
    const Eigen::Vector2d c = diagram.sites().col(i);
    const double w = diagram.weights()[i];
    const double cost = m.second - 2.0 * (c.x() * m.x + c.y() * m.y) + c.squaredNorm() * m.mass;
    energy += w * (m.mass - wanted[i]) - cost;
  }
  return energy;
}

}  // namespace lensforge
