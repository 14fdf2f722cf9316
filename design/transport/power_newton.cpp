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

/// Share of the sites whose weights a trial may raise to keep their cells, before it is given up. A
/// handful of cells would otherwise hold back the step of all others: 41 instead of 56 Newton steps
/// for the logo on 235,520 sites. From 0.001 to 0.03 it took the same.
constexpr double kMaxRaised = 0.01;

Eigen::Map<const Eigen::VectorXd> masses_of(const PowerCells& cells) {
  return {cells.mass.data(), static_cast<Eigen::Index>(cells.mass.size())};
}

/// The diagram that `from` becomes under `weights`; sites that these would hide are shown where
/// that is possible.
PowerDiagram shown(const PowerDiagram& from, const SiteLevel& level, const Eigen::VectorXd& weights,
                   const Executor& executor) {
  std::optional<PowerDiagram> diagram =
      from.reweighted(weights, level.order, executor, static_cast<int>(level.masses.size()));
  if (diagram) return std::move(*diagram);
  return {level.sites, weights, level.order, executor.stop_token()};
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
                       const Executor& executor, CellStage& stage) {
  const PowerDiagram even(level.sites, Eigen::VectorXd::Zero(level.sites.cols()), level.order,
                          executor.stop_token());
  return measured(shown(even, level, weights, executor), executor, stage);
}

PowerState power_state(const SiteLevel& level, const PowerState& from,
                       const Eigen::VectorXd& weights, const Executor& executor, CellStage& stage) {
  return measured(shown(from.diagram, level, weights, executor), executor, stage);
}

double mass_error(const SiteLevel& level, const PowerCells& cells) {
  return ((masses_of(cells) - level.masses).array().abs() / level.masses.array()).maxCoeff();
}

double misplaced_share(const SiteLevel& level, const PowerCells& cells) {
  return 0.5 * (masses_of(cells) - level.masses).lpNorm<1>() / level.masses.sum();
}

namespace {

/// What trial steps are measured with and held against.
struct Search {
  const SiteLevel& level;
  const Executor& executor;
  CellStage& stage;
  double least;  ///< Mass that every cell keeps.

  /// The state that a step of `length` times the Newton direction leads to, if that is good enough.
  [[nodiscard]] std::optional<PowerState> step(const PowerState& state,
                                               const Eigen::VectorXd& direction,
                                               double length) const {
    const int max_raises = static_cast<int>(kMaxRaised * static_cast<double>(direction.size()));
    std::optional<PowerDiagram> diagram = state.diagram.reweighted(
        state.diagram.weights() + length * direction, level.order, executor, max_raises);
    if (!diagram) return std::nullopt;  // A site without a cell has no mass either.
    PowerState trial = measured(std::move(*diagram), executor, stage);
    const auto mass = masses_of(trial.cells);
    const double before = (level.masses - masses_of(state.cells)).norm();
    const double after = (level.masses - mass).norm();
    if (mass.minCoeff() < least || !(after <= (1.0 - 0.5 * length) * before)) return std::nullopt;
    return trial;
  }
};

}  // namespace

bool balance_masses(const SiteLevel& level, const NewtonControl& control, const Executor& executor,
                    CellStage& stage, PowerState& state) {
  const double least = 0.5 * std::min(masses_of(state.cells).minCoeff(), level.masses.minCoeff());
  const Search search{level, executor, stage, least};
  double error = mass_error(level, state.cells);
  double first = 1.0;
  while (error > control.mass_error) {
    const Eigen::VectorXd residual = level.masses - masses_of(state.cells);
    const Eigen::VectorXd direction = stage.newton_direction(state.edges, residual);
    if (!direction.allFinite()) return false;
    double length = first;
    std::optional<PowerState> next = search.step(state, direction, length);
    for (int halvings = 0; !next && halvings < kMaxHalvings; ++halvings) {
      length *= 0.5;
      next = search.step(state, direction, length);
    }
    if (!next) return false;
    state = std::move(*next);
    first = std::min(1.0, (length == first ? kGrowth : kRetry) * length);
    error = mass_error(level, state.cells);
    if (!control.observe({length, error})) return false;
  }
  return true;
}

}  // namespace lensforge
