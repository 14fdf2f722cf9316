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

/// Sites merged at their centre of mass; parent[i] is the cluster of site i.
struct SiteClusters {
  Eigen::Matrix2Xd sites;
  Eigen::VectorXd masses;
  std::vector<int> parent;
};

/// Clusters 3 or 4 neighbouring sites by repeatedly halving them across the longer side of their
/// box; coincident clusters are merged. On grids the clusters are blocks. Clusters along a Hilbert
/// curve are ragged, and upsampling from them leaves five times as many cells empty.
SiteClusters cluster_sites(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses);

/// Merges sites closer than kCoincident times the extent of all (in each coordinate, on a lattice
/// of that spacing); sites without mass get parent −1.
SiteClusters merge_coincident(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses);

/// Weights are of the order of the extent squared, so the border between sites at distance d is
/// accurate to 2⁻⁵² extent²/d: at this distance 1e-8 of the extent.
inline constexpr double kCoincident = 1.5e-8;

/// Levels from fine to coarse: level 0 holds the given sites, each further level the clusters of
/// the previous one, as long as `coarsest` or more remain. Sites on one line make a single level.
std::vector<SiteLevel> make_site_levels(const Eigen::Matrix2Xd& sites,
                                        const Eigen::VectorXd& masses, int coarsest);

/// A power diagram with the contents of its cells.
struct PowerState {
  PowerDiagram diagram;
  CellEdges edges;
  PowerCells cells;
};

/// Makes the diagram for `weights` and measures its cells. The triangulation is computed on the
/// CPU, by `executor`. Weights of sites that would be hidden are raised.
/// @throw Interrupted if the executor's stop is requested.
PowerState power_state(const SiteLevel& level, const Eigen::VectorXd& weights,
                       const Executor& executor, CellStage& stage);

/// The same, starting from another state of the level; faster the less they differ.
PowerState power_state(const SiteLevel& level, const PowerState& from,
                       const Eigen::VectorXd& weights, const Executor& executor, CellStage& stage);

/// max |mass − wanted| / wanted.
double mass_error(const SiteLevel& level, const PowerCells& cells);

/// Share of all mass in the wrong cell, ½ Σ |mass − wanted| / Σ wanted.
double misplaced_share(const SiteLevel& level, const PowerCells& cells);

/// Result of one accepted step.
struct NewtonStep {
  double length = 0.0;      ///< Share of the Newton direction.
  double mass_error = 0.0;  ///< After the step.
};

/// End of the iteration, and its observer.
struct NewtonControl {
  double mass_error = 1e-4;  ///< The iteration ends below it.
  /// Called after every step; false ends the iteration.
  std::function<bool(const NewtonStep&)> observe;
};

/// Changes the weights until the cells hold the wanted masses. A step solves L δ = wanted − mass
/// with the graph Laplacian L = ∂mass/∂w and is halved until the residual falls and every cell
/// keeps half of min(least mass at the start, least wanted mass) (Kitagawa, Mérigot & Thibert 2019,
/// Algorithm 1). If a step would hide a few sites, only their weights change less.
/// @pre `state` was measured last, and every cell of it has positive mass.
/// @return true if the error fell below control.mass_error.
/// @throw Interrupted if the executor's stop is requested.
bool balance_masses(const SiteLevel& level, const NewtonControl& control, const Executor& executor,
                    CellStage& stage, PowerState& state);

// Starting weights for Newton's method. Notation: c a site, w its weight, ψ = (|c|² − w)/2 the
// Brenier potential at it, g its cell's centre of mass, which is the slope of ψ there.

Eigen::VectorXd weights_of_potential(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& psi);
Eigen::VectorXd potential_of_weights(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights);

/// Centres of mass of the cells, 2 × n, from their moments; a cell without mass gets its site.
Eigen::Matrix2Xd cell_centroids(const PowerDiagram& diagram, const SummedDensity& density,
                                const std::vector<Moments>& moments);

/// Weights under which every cell has room in the picture: those of a stretch of the sites' box
/// onto slightly less than the picture.
Eigen::VectorXd stretched_weights(const Eigen::Matrix2Xd& sites, const SummedDensity& density);

/// Weights of the sites of `fine` from a solved coarser level.
///
/// In a triangle of coarse sites with shares λ: ψ(c) = Σ λ_k (ψ_k + g_k·(c − c_k)/2), exact where ψ
/// is quadratic. The coarse sites are mirrored at the borders of the fine sites' box, with ψ
/// continued evenly about the slope of the picture's border, so that every fine site lies in a
/// triangle (otherwise long triangles along the hull upset thousands of cells).
/// @param coarse  solved: its masses under the density of `stage` are the wanted ones.
Eigen::VectorXd upsampled_weights(const PowerState& coarse, CellStage& stage,
                                  const Eigen::Matrix2Xd& fine, const std::vector<int>& order,
                                  const std::stop_token& stop);

/// Gives room to empty or almost empty cells: ψ of such a cell is lowered to the highest tangent
/// plane ψ_j + g_j·(c − c_j) of the cells around, so that it takes a part of that cell. A cell
/// gives to a few at a time, so this takes several rounds.
/// @return false if some are still empty after many rounds.
bool mend_empty_cells(const SiteLevel& level, const Executor& executor, CellStage& stage,
                      PowerState& state);

}  // namespace lensforge
