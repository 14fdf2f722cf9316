// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_cells.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "core/error.h"
#include "design/transport/laplacian.h"
#include "design/transport/power_cells_on.h"

namespace lensforge {
namespace {

/// The integrals one pixel to the right; `left` is the pixel's left side.
DensityPixel advanced(const DensityPixel& before, double left) {
  DensityPixel after = before;
  after.value = 0.0;
  after.mass += before.value;
  after.first += before.value * (left + 0.5);
  after.second += before.value * (left * (left + 1.0) + 1.0 / 3.0);
  return after;
}

}  // namespace

SummedDensity::SummedDensity(const Image& picture, double total)
    : columns_(picture.columns()), rows_(picture.rows()) {
  const double sum = picture.total();
  LF_CHECK(sum > 0.0 && std::isfinite(sum) && total > 0.0 && std::isfinite(total),
           std::to_string(sum) + " scaled to " + std::to_string(total));
  const double scale = total / sum;
  pixels_.reserve(picture.values().size());
  border_.emplace_back();
  for (int r = 0; r < rows_; ++r) {
    DensityPixel running;
    for (int c = 0; c < columns_; ++c) {
      const auto value = static_cast<double>(picture.at(c, r));
      LF_CHECK(value >= 0.0, std::to_string(value));
      running.value = scale * value;
      pixels_.push_back(running);
      running = advanced(running, c);
    }
    row_ends_.push_back(running);
    Moments next = border_.back();
    next += density_strip(running, r, r + 1.0);
    border_.push_back(next);
  }
}

namespace {

/// Rays are cut at this many extents of picture and sites.
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
  // If no edge crosses the border, one cell has all of it; its middle is the safest point.
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

std::unique_ptr<CellStage> make_cell_stage(const Eigen::Matrix2Xd& sites,
                                           const Executor& executor) {
#if defined(LENSFORGE_CUDA)
  if (executor.device() == Device::kCuda && sites.cols() > kDirectLimit) {
    return make_cuda_cell_stage(sites, executor);
  }
#endif
  return std::make_unique<CellStageOn<Executor>>(sites, executor);
}

namespace {

WeightedGraph coupling(std::span<const DualEdge> edges, std::span<const EdgeMeasure> measures,
                       double even, Eigen::Index nodes) {
  WeightedGraph graph;
  graph.nodes = static_cast<int>(nodes);
  graph.edges.reserve(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const EdgeMeasure& m = measures[e];
    // Edges outside the picture couple nothing.
    if (!(m.even_coupling > 0.0)) continue;
    graph.edges.push_back({edges[e].left, edges[e].right, m.coupling + even * m.even_coupling});
  }
  return graph;
}

}  // namespace

Eigen::VectorXd factorised_direction(std::span<const DualEdge> edges,
                                     std::span<const EdgeMeasure> measures, double even,
                                     const Eigen::VectorXd& right) {
  return LaplacianFactor(coupling(edges, measures, even, right.size())).solve(right);
}

Eigen::VectorXd NewtonSystem<Executor>::solve(const CellView& /*cells*/,
                                              std::span<const DualEdge> edges,
                                              std::span<const EdgeMeasure> measures, double even,
                                              const Eigen::VectorXd& right) const {
  const WeightedGraph graph = coupling(edges, measures, even, right.size());
  if (graph.nodes <= kDirectLimit) return LaplacianFactor(graph).solve(right);
  MultigridOptions options;
  options.tolerance = kDirectionTolerance;
  MultigridSolution solution = solve_by_multigrid(graph, right, options, executor_);
  // Has not happened yet; the factorisation is slower but works for any weights.
  if (!(solution.residual <= options.tolerance)) return LaplacianFactor(graph).solve(right);
  return std::move(solution.x);
}

}  // namespace lensforge
