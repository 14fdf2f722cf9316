// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_newton.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "design/transport/laplacian_solver.h"
#include "design/transport/multigrid.h"

namespace lensforge {

namespace {

/// Borders that run through black do not couple their cells at all, and whole groups of cells would
/// hang loose from the others. So L is that of a density with this share spread evenly; masses are
/// not touched by it, and nothing but the direction of a step depends on it.
constexpr double kCouplingFloor = 1e-9;

/// Halvings of a step before it is given up.
constexpr int kMaxHalvings = 24;

/// Where the next step begins, in lengths of the last: every halving costs a power diagram, and
/// lengths change slowly from step to step. (58,880 sites, logo on black, mesh spread over it: 7.4
/// processor seconds; from 1 each time 9.6.)
constexpr double kGrowth = 4.0;  ///< If that was accepted at once,
constexpr double kRetry = 2.0;   ///< and if not.

/// Sites above which multigrid takes over from the factorisation. Processor seconds for a Newton
/// system on 2 cores (CHOLMOD, supernodal, on OpenBLAS), logo on black: equal at 14,720 sites, 0.08
/// against 0.2 at 58,880, 1.1 against 4 at 942,080; black pixels take no more iterations than grey
/// ones.
constexpr int kDirectLimit = 12000;

/// Residual of the multigrid solution. Steps are as many as with exact directions (58,880 sites:
/// 31 on a photograph, 56 on the logo, both ways); a tenth of it costs a third more time.
constexpr double kDirectionTolerance = 1e-2;

Eigen::Map<const Eigen::VectorXd> masses_of(const PowerCells& cells) {
  return {cells.mass.data(), static_cast<Eigen::Index>(cells.mass.size())};
}

WeightedGraph coupling(const PowerState& state, const SummedDensity& density) {
  const double even = kCouplingFloor * density.total() / density.columns() / density.rows();
  WeightedGraph graph;
  graph.nodes = static_cast<int>(state.diagram.sites().cols());
  graph.edges.reserve(state.cells.borders.size());
  for (const PowerCells::Border& b : state.cells.borders) {
    graph.edges.push_back({b.left, b.right, b.mass + even * b.area});
  }
  return graph;
}

/// The Newton direction of the weights.
Eigen::VectorXd newton_direction(const PowerState& state, const SummedDensity& density,
                                 const Eigen::VectorXd& residual, const Executor& executor) {
  const WeightedGraph graph = coupling(state, density);
  if (graph.nodes <= kDirectLimit) return LaplacianFactor(graph).solve(residual);
  MultigridOptions options;
  options.tolerance = kDirectionTolerance;
  MultigridSolution solution = solve_by_multigrid(graph, residual, options, executor);
  // Not seen yet; the factorisation is slower but takes any weights.
  if (!(solution.residual <= options.tolerance)) return LaplacianFactor(graph).solve(residual);
  return std::move(solution.x);
}

}  // namespace

PowerState power_state(const SiteLevel& level, const Eigen::VectorXd& weights,
                       const SummedDensity& density, const Executor& executor,
                       const std::stop_token& stop) {
  PowerDiagram diagram(level.sites, weights, level.order, stop);
  PowerCells cells = measure_cells(diagram, density, executor);
  return {std::move(diagram), std::move(cells)};
}

double mass_error(const SiteLevel& level, const PowerCells& cells) {
  return ((masses_of(cells) - level.masses).array().abs() / level.masses.array()).maxCoeff();
}

bool balance_masses(const SiteLevel& level, const SummedDensity& density,
                    const NewtonControl& control, const Executor& executor, PowerState& state) {
  const double least = 0.5 * std::min(masses_of(state.cells).minCoeff(), level.masses.minCoeff());
  double error = mass_error(level, state.cells);
  double first = 1.0;
  while (error > control.mass_error) {
    const Eigen::VectorXd residual = level.masses - masses_of(state.cells);
    const Eigen::VectorXd direction = newton_direction(state, density, residual, executor);
    if (!direction.allFinite()) return false;
    bool accepted = false;
    double length = 2.0 * first;
    int halvings = 0;
    for (; halvings < kMaxHalvings && !accepted; ++halvings) {
      length *= 0.5;
      PowerState trial = power_state(level, state.diagram.weights() + length * direction, density,
                                     executor, control.stop);
      const auto mass = masses_of(trial.cells);
      accepted = mass.minCoeff() >= least &&
                 (level.masses - mass).norm() <= (1.0 - 0.5 * length) * residual.norm();
      if (accepted) state = std::move(trial);
    }
    if (!accepted) return false;
    first = std::min(1.0, (halvings == 1 ? kGrowth : kRetry) * length);
    error = mass_error(level, state.cells);
    if (!control.observe({length, error})) return false;
  }
  return true;
}

}  // namespace lensforge
