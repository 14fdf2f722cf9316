// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>
#include <vector>

#include "core/compute/executor.h"
#include "design/transport/power_cells.h"
#include "design/transport/power_diagram.h"

namespace lensforge {

/// Sites of one resolution, all different and of positive mass.
struct SiteLevel {
  Eigen::Matrix2Xd sites;  ///< 2 × n, pixels.
  Eigen::VectorXd masses;  ///< n, positive.
  std::vector<int> order;  ///< spatial_order(sites).
};

/// Sites put together at the centre of their mass; parent[i] is the cluster of site i.
struct SiteClusters {
  Eigen::Matrix2Xd sites;
  Eigen::VectorXd masses;
  std::vector<int> parent;
};

/// Clusters of 3 or 4 neighbours by halving the sites across the longer side of their box again and
/// again; clusters that fall together are one. On grids the clusters are blocks: clusters along a
/// Hilbert curve are ragged, and five times as many cells start empty after upsampling from them.
SiteClusters cluster_sites(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses);

/// Sites closer than kCoincident times the extent of all (in each coordinate, on a lattice of that
/// spacing) as one; sites without mass have parent −1.
SiteClusters merge_coincident(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses);

/// Weights are of the order of the extent squared, so the border between sites at distance d is
/// placed to 2⁻⁵² extent²/d: at this distance 1e-8 of the extent.
inline constexpr double kCoincident = 1.5e-8;

/// From fine to coarse: level 0 holds the given sites, each next one the clusters of the one
/// before, while that leaves `coarsest` or more. Sites on one line make a single level.
std::vector<SiteLevel> make_site_levels(const Eigen::Matrix2Xd& sites,
                                        const Eigen::VectorXd& masses, int coarsest);

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

// Starts for the Newton method. Notation: c a site, w its weight, ψ = (|c|² − w)/2 the Brenier
// potential at it, g its cell's centre of mass, which is the slope of ψ there.

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
