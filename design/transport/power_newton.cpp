// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_newton.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "design/transport/laplacian_solver.h"

namespace lensforge {

namespace {

/// Borders that run through black do not couple their cells at all, and whole groups of cells would
/// hang loose from the others. So L is that of a density with this share spread evenly; masses are
/// not touched by it, and nothing but the direction of a step depends on it.
constexpr double kCouplingFloor = 1e-9;

/// Halvings of a step before it is given up.
constexpr int kMaxHalvings = 24;

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
  while (error > control.mass_error) {
    const Eigen::VectorXd residual = level.masses - masses_of(state.cells);
    const Eigen::VectorXd direction = solve_laplacian(coupling(state, density), residual);
    if (!direction.allFinite()) return false;
    bool accepted = false;
    double length = 2.0;
    for (int halving = 0; halving < kMaxHalvings && !accepted; ++halving) {
      length *= 0.5;
      PowerState trial = power_state(level, state.diagram.weights() + length * direction, density,
                                     executor, control.stop);
      const auto mass = masses_of(trial.cells);
      accepted = mass.minCoeff() >= least &&
                 (level.masses - mass).norm() <= (1.0 - 0.5 * length) * residual.norm();
      if (accepted) state = std::move(trial);
    }
    if (!accepted) return false;
    error = mass_error(level, state.cells);
    if (!control.observe({length, error})) return false;
  }
  return true;
}

}  // namespace lensforge
