// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_newton.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace lensforge {

namespace {

/// Halvings of a step before it is given up.
constexpr int kMaxHalvings = 24;

/// Where the next step begins, in lengths of the last: every halving costs a power diagram, and
/// lengths change slowly from step to step. (58,880 sites, logo on black, mesh spread over it: 7.4
/// processor seconds; from 1 each time 9.6.)
constexpr double kGrowth = 4.0;  ///< If that was accepted at once,
constexpr double kRetry = 2.0;   ///< and if not.

Eigen::Map<const Eigen::VectorXd> masses_of(const PowerCells& cells) {
  return {cells.mass.data(), static_cast<Eigen::Index>(cells.mass.size())};
}

/// Measures the cells of a diagram.
PowerState measured(PowerDiagram diagram, const Executor& executor, CellStage& stage) {
  const SummedDensity& density = stage.density();
  CellEdges edges = cell_edges(diagram, density.columns(), density.rows(), executor);
  PowerCells cells = stage.measure(edges);
  return {std::move(diagram), std::move(edges), std::move(cells)};
}

}  // namespace

PowerState power_state(const SiteLevel& level, const Eigen::VectorXd& weights,
                       const Executor& executor, const std::stop_token& stop, CellStage& stage) {
  return measured(PowerDiagram(level.sites, weights, level.order, stop), executor, stage);
}

double mass_error(const SiteLevel& level, const PowerCells& cells) {
  return ((masses_of(cells) - level.masses).array().abs() / level.masses.array()).maxCoeff();
}

double misplaced_share(const SiteLevel& level, const PowerCells& cells) {
  return 0.5 * (masses_of(cells) - level.masses).lpNorm<1>() / level.masses.sum();
}

bool balance_masses(const SiteLevel& level, const NewtonControl& control, const Executor& executor,
                    CellStage& stage, PowerState& state) {
  const double least = 0.5 * std::min(masses_of(state.cells).minCoeff(), level.masses.minCoeff());
  double error = mass_error(level, state.cells);
  double first = 1.0;
  while (error > control.mass_error) {
    const Eigen::VectorXd residual = level.masses - masses_of(state.cells);
    const Eigen::VectorXd direction = stage.newton_direction(state.edges, residual);
    if (!direction.allFinite()) return false;
    bool accepted = false;
    double length = 2.0 * first;
    int halvings = 0;
    for (; halvings < kMaxHalvings && !accepted; ++halvings) {
      length *= 0.5;
      std::optional<PowerDiagram> diagram = state.diagram.reweighted(
          state.diagram.weights() + length * direction, level.order, executor);
      if (!diagram) continue;  // A site without a cell has no mass either.
      PowerState trial = measured(std::move(*diagram), executor, stage);
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
