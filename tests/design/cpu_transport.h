// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "design/transport/power_cells.h"
#include "design/transport/power_cells_on.h"

/// Scenes for transport on several executors, and the CPU's results for them; compiled separately,
/// like cpu_reference.h.
namespace lensforge::testing {

/// A power diagram, taken apart, and a density.
struct CellScene {
  Eigen::Matrix2Xd sites;
  std::shared_ptr<const SummedDensity> density;
  CellEdges edges;
};

/// Thousands of cells over a picture without black, of which some are hidden and some lie outside;
/// as many, all of them inside, over a logo on black; and a single one.
const std::vector<const CellScene*>& cell_scenes();

std::unique_ptr<CellStage> cpu_stage_of(const CellScene& scene);
Eigen::VectorXd cpu_direction(const CellScene& scene, const Eigen::VectorXd& residual);
std::vector<EdgeMeasure> cpu_edge_measures(const CellScene& scene);

/// The logo's cells.
const CellScene& logo_scene();
/// Few cells, some of which are tied to no others.
const CellScene& loose_scene();

/// Numbers between −1 and 1 that sum to 0.
Eigen::VectorXd some_residual(const CellScene& scene);
/// L x, from the CPU's edges.
Eigen::VectorXd newton_matrix_times(const CellScene& scene, const Eigen::VectorXd& x);

/// A transport from its start to the end.
struct BalancedCells {
  Eigen::VectorXd weights;
  double mass_error = 0.0;
  int steps = 0;
};
inline constexpr double kBalancedTo = 1e-8;
/// Even masses over a smooth picture.
const CellScene& spot_scene();
BalancedCells balanced(CellStage& stage);

}  // namespace lensforge::testing
