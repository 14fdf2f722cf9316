// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/newton_system.h"

#include <utility>

#include "design/transport/laplacian_solver.h"
#include "design/transport/multigrid.h"

namespace lensforge {

namespace {

WeightedGraph coupling(std::span<const DualEdge> edges, std::span<const EdgeMeasure> measures,
                       double even, Eigen::Index nodes) {
  WeightedGraph graph;
  graph.nodes = static_cast<int>(nodes);
  graph.edges.reserve(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const EdgeMeasure& m = measures[e];
    // Edges outside of the picture couple nothing.
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
  // Not seen yet; the factorisation is slower but takes any weights.
  if (!(solution.residual <= options.tolerance)) return LaplacianFactor(graph).solve(right);
  return std::move(solution.x);
}

}  // namespace lensforge
