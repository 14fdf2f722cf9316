// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

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

}  // namespace lensforge
