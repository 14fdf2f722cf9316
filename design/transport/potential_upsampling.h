// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "core/compute/executor.h"
#include "design/transport/power_newton.h"
#include "design/transport/site_levels.h"
#include "design/transport/summed_density.h"

/// Starts for the Newton method. Notation: c a site, w its weight, ψ = (|c|² − w)/2 the Brenier
/// potential at it, g its cell's centre of mass, which is the slope of ψ there.
namespace lensforge {

Eigen::VectorXd weights_of_potential(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& psi);
Eigen::VectorXd potential_of_weights(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights);

/// Mass centres of the cells, 2 × n, from their moments; a cell without mass gives its site.
Eigen::Matrix2Xd cell_centroids(const PowerDiagram& diagram, const SummedDensity& density,
                                const std::vector<Moments>& moments);

/// Weights under which every cell's part of the picture has room: those of a stretch of the sites'
/// box onto the picture, which lies inside of the picture for every site.
Eigen::VectorXd stretched_weights(const Eigen::Matrix2Xd& sites, const SummedDensity& density);

/// Weights of the sites of `fine` from a solved coarser level.
///
/// In a triangle of coarse sites, shares λ: ψ(c) = Σ λ_k (ψ_k + g_k·(c − c_k)/2), exact where ψ is
/// quadratic. So that no site lies outside of all triangles, the coarse sites are mirrored at the
/// borders of the fine sites' box with ψ continued evenly about the slope of the picture's border
/// (without that, long triangles along the hull upset thousands of cells).
/// @param coarse  solved; masses under the density of `stage`, its own, are the wanted ones.
Eigen::VectorXd upsampled_weights(const PowerState& coarse, CellStage& stage,
                                  const Eigen::Matrix2Xd& fine, const std::vector<int>& order,
                                  const std::stop_token& stop);

/// Gives room to cells that are empty or nearly so: a hidden or empty cell's ψ is lowered to the
/// highest tangent plane ψ_j + g_j·(c − c_j) of the cells around, so that it takes a part of that
/// cell; a cell gives to a few at a time, so this goes by rounds.
/// @return false if some are still empty after many rounds.
bool mend_empty_cells(const SiteLevel& level, const Executor& executor, CellStage& stage,
                      PowerState& state);

}  // namespace lensforge
