// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/compute/executor.h"
#include "design/transport/cell_edges.h"
#include "design/transport/cell_stage.h"
#include "design/transport/power_diagram.h"
#include "design/transport/site_levels.h"

namespace lensforge {

/// A power diagram and what its cells hold.
struct PowerState {
  PowerDiagram diagram;
  CellEdges edges;
  PowerCells cells;
};

/// Cuts the plane by `weights` and measures. The triangulation is found on the CPU, by `executor`.
/// Of a site that these would hide the weight is raised.
/// @throw Interrupted if the executor's stop is requested.
PowerState power_state(const SiteLevel& level, const Eigen::VectorXd& weights,
                       const Executor& executor, CellStage& stage);

/// The same by way of another state of the level, which is the faster the less they differ.
PowerState power_state(const SiteLevel& level, const PowerState& from,
                       const Eigen::VectorXd& weights, const Executor& executor, CellStage& stage);

/// max |mass − wanted| / wanted.
double mass_error(const SiteLevel& level, const PowerCells& cells);

/// Share of all mass that is in the wrong cell, ½ Σ |mass − wanted|.
double misplaced_share(const SiteLevel& level, const PowerCells& cells);

/// What one accepted step did.
struct NewtonStep {
  double length = 0.0;      ///< Share of the Newton direction.
  double mass_error = 0.0;  ///< After the step.
};

/// When to end, and where steps are told.
struct NewtonControl {
  double mass_error = 1e-4;  ///< Ends below it.
  /// Asked after every step; false ends.
  std::function<bool(const NewtonStep&)> observe;
};

/// Moves the weights until the cells hold the wanted masses. A step solves L δ = wanted − mass with
/// the graph Laplacian L = ∂mass/∂w and is halved until the residual falls and every cell keeps
/// half of min(least mass at the start, least wanted mass) (Kitagawa, Mérigot & Thibert 2019,
/// Algorithm 1). Where the step would hide a few sites, their weights alone move less far.
/// @pre `state` was the last to be measured, and every cell of it has positive mass.
/// @return true if the error fell below control.mass_error.
/// @throw Interrupted if the executor's stop is requested.
bool balance_masses(const SiteLevel& level, const NewtonControl& control, const Executor& executor,
                    CellStage& stage, PowerState& state);

}  // namespace lensforge
