// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/site_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "design/transport/power_diagram.h"

namespace lensforge {

namespace {

/// Sites that make one coarser site, at most.
constexpr std::size_t kClusterSize = 4;

/// False if all sites lie on one line, or nearly: then there are no triangles to upsample in.
bool is_two_dimensional(const Eigen::Matrix2Xd& sites) {
  const Eigen::Matrix2Xd offsets = sites.colwise() - sites.rowwise().mean();
  const Eigen::Matrix2d spread = offsets * offsets.transpose();
  const double determinant = spread(0, 0) * spread(1, 1) - spread(0, 1) * spread(1, 0);
  return determinant > 1e-12 * spread.trace() * spread.trace();
}

double extent_of(const Eigen::Matrix2Xd& sites) {
  return (sites.rowwise().maxCoeff() - sites.rowwise().minCoeff()).maxCoeff();
}

/// Sums masses and mass-weighted places per parent.
SiteClusters gather(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses,
                    std::vector<int> parent, int count) {
  SiteClusters clusters;
  clusters.sites = Eigen::Matrix2Xd::Zero(2, count);
  clusters.masses = Eigen::VectorXd::Zero(count);
  for (std::size_t k = 0; k < parent.size(); ++k) {
    if (parent[k] < 0) continue;
    const auto i = static_cast<Eigen::Index>(k);
    clusters.sites.col(parent[k]) += masses[i] * sites.col(i);
    clusters.masses[parent[k]] += masses[i];
  }
  for (int c = 0; c < count; ++c) clusters.sites.col(c) /= clusters.masses[c];
  clusters.parent = std::move(parent);
  return clusters;
}

}  // namespace

SiteClusters merge_coincident(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses) {
  using Key = std::array<std::int64_t, 3>;
  const Eigen::Vector2d low = sites.rowwise().minCoeff();
  const double extent = extent_of(sites);
  const double scale = extent > 0.0 ? 1.0 / (kCoincident * extent) : 0.0;
  std::vector<Key> keys;
  for (Eigen::Index i = 0; i < sites.cols(); ++i) {
    const Eigen::Vector2d p = scale * (sites.col(i) - low);
    if (masses[i] > 0.0) keys.push_back({std::llround(p.x()), std::llround(p.y()), i});
  }
  std::sort(keys.begin(), keys.end());
  std::vector<int> leader(static_cast<std::size_t>(sites.cols()), -1);
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const bool same = k > 0 && keys[k][0] == keys[k - 1][0] && keys[k][1] == keys[k - 1][1];
    leader[static_cast<std::size_t>(keys[k][2])] =
        static_cast<int>(same ? leader[static_cast<std::size_t>(keys[k - 1][2])] : keys[k][2]);
  }
  // Numbers in the order of the sites, so that without coincidences nothing is renumbered.
  std::vector<int> number(leader.size(), -1);
  std::vector<int> parent(leader.size(), -1);
  int count = 0;
  for (std::size_t i = 0; i < leader.size(); ++i) {
    if (leader[i] < 0) continue;
    int& n = number[static_cast<std::size_t>(leader[i])];
    if (n < 0) n = count++;
    parent[i] = n;
  }
  return gather(sites, masses, std::move(parent), count);
}

namespace {

/// Halves a part across its longer side until no piece has more than kClusterSize sites.
class Splitting {
 public:
  explicit Splitting(const Eigen::Matrix2Xd& sites)
      : sites_(sites), parent_(static_cast<std::size_t>(sites.cols())) {
    std::vector<int> all(parent_.size());
    std::iota(all.begin(), all.end(), 0);
    split(all);
  }
  [[nodiscard]] const std::vector<int>& parent() const { return parent_; }
  [[nodiscard]] int count() const { return count_; }

 private:
  void split(std::span<int> part) {
    if (part.size() <= kClusterSize) {
      for (const int i : part) parent_[static_cast<std::size_t>(i)] = count_;
      ++count_;
      return;
    }
    Eigen::Vector2d low = sites_.col(part[0]);
    Eigen::Vector2d high = low;
    for (const int i : part) {
      low = low.cwiseMin(sites_.col(i));
      high = high.cwiseMax(sites_.col(i));
    }
    const Eigen::Index axis = (high - low).x() >= (high - low).y() ? 0 : 1;
    const std::size_t middle = part.size() / 2;
    const auto before = [&](int i, int j) {
      return std::tuple(sites_(axis, i), sites_(1 - axis, i), i) <
             std::tuple(sites_(axis, j), sites_(1 - axis, j), j);
    };
    std::nth_element(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(middle), part.end(),
                     before);
    split(part.subspan(0, middle));
    split(part.subspan(middle));
  }

  const Eigen::Matrix2Xd& sites_;
  std::vector<int> parent_;
  int count_ = 0;
};

}  // namespace

SiteClusters cluster_sites(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses) {
  const Splitting splitting(sites);
  SiteClusters clusters = gather(sites, masses, splitting.parent(), splitting.count());
  SiteClusters merged = merge_coincident(clusters.sites, clusters.masses);
  for (int& p : clusters.parent) p = merged.parent[static_cast<std::size_t>(p)];
  merged.parent = std::move(clusters.parent);
  return merged;
}

std::vector<SiteLevel> make_site_levels(const Eigen::Matrix2Xd& sites,
                                        const Eigen::VectorXd& masses, int coarsest) {
  std::vector<SiteLevel> levels;
  levels.push_back({sites, masses, spatial_order(sites)});
  while (levels.back().sites.cols() >= static_cast<Eigen::Index>(kClusterSize) * coarsest &&
         is_two_dimensional(levels.back().sites)) {
    SiteClusters clusters = cluster_sites(levels.back().sites, levels.back().masses);
    std::vector<int> order = spatial_order(clusters.sites);
    levels.push_back({std::move(clusters.sites), std::move(clusters.masses), std::move(order)});
  }
  return levels;
}

}  // namespace lensforge
