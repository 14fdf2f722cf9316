// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>

#include "core/executor.h"
#include "design/transport/power_cells.h"
#include "design/transport/power_diagram.h"
#include "design/transport/site_levels.h"
#include "design/transport/summed_density.h"

namespace lensforge {

/// A power diagram and what its cells hold.
struct PowerState {
  PowerDiagram diagram;
  PowerCells cells;
};

/// Cuts the plane by `weights` and measures. @throw Interrupted
PowerState power_state(const SiteLevel& level, const Eigen::VectorXd& weights,
                       const SummedDensity& density, const Executor& executor,
                       const std::stop_token& stop);

/// max |mass − wanted| / wanted.
double mass_error(const SiteLevel& level, const PowerCells& cells);

/// What one accepted step did.
struct NewtonStep {
  double length = 0.0;      ///< Share of the Newton direction.
  double mass_error = 0.0;  ///< After the step.
};

/// When to end, and where steps are told and the work may be interrupted.
struct NewtonControl {
  double mass_error = 1e-4;  ///< Ends below it.
  /// Asked after every step; false ends.
  std::function<bool(const NewtonStep&)> observe;
  std::stop_token stop;
};

/// Moves the weights until the cells hold the wanted masses. A step solves L δ = wanted − mass with
/// the graph Laplacian L = ∂mass/∂w and is halved until the residual falls and every cell keeps
/// half of min(least mass at the start, least wanted mass) (Kitagawa, Mérigot & Thibert 2019,
/// Algorithm 1).
/// @pre every cell of `state` has positive mass under `density`.
/// @return true if the error fell below control.mass_error. @throw Interrupted
bool balance_masses(const SiteLevel& level, const SummedDensity& density,
                    const NewtonControl& control, const Executor& executor, PowerState& state);

}  // namespace lensforge
