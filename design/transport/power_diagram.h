// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "design/transport/regular_triangulation.h"

namespace lensforge {

/// The border between two power cells, run so that the cell of `left` lies on its left (x to the
/// right, y "up"). Ends are exact to rounding where they lie near the picture; an end far away is
/// moved along the edge to a place far outside.
struct DualEdge {
  int left;
  int right;
  Eigen::Vector2d from;
  Eigen::Vector2d to;
};

/// The order in which sites are inserted and walked: neighbours in the order are neighbours in the
/// plane. It depends on the sites only, so one order serves all weights.
std::vector<int> spatial_order(const Eigen::Matrix2Xd& sites);

/// The power diagram of sites c with weights w, {x : |x − c_i|² − w_i ≤ |x − c_j|² − w_j for all j}
/// (Sun et al. 3.4), as the dual of the regular triangulation. Its edges hang on sites and weights
/// only, to the bit, not on the way to them.
class PowerDiagram {
 public:
  /// @param sites    2 × n, all different.
  /// @param weights  n, finite.
  /// @param order    spatial_order(sites).
  /// @pre n ≥ 1. @throw Interrupted within a few thousand insertions after `stop` is requested.
  PowerDiagram(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
               const std::vector<int>& order, const std::stop_token& stop);

  /// The diagram of the same sites with other weights, for a fraction of the time if weights change
  /// little: by flips in the triangulation of this one, if no site of it is hidden.
  /// A site that would be hidden gets, up to `max_raises` times, a higher weight: one with which it
  /// lies below a triangle around it by half as much as in this diagram.
  /// @return nothing if a site would still be hidden. @throw Interrupted
  [[nodiscard]] std::optional<PowerDiagram> reweighted(const Eigen::VectorXd& weights,
                                                       const std::vector<int>& order,
                                                       const Executor& executor,
                                                       int max_raises = 0) const;

  [[nodiscard]] const Eigen::Matrix2Xd& sites() const { return *sites_; }
  [[nodiscard]] const Eigen::VectorXd& weights() const { return weights_; }

  /// The site whose cell holds a point, by looking at all; the first of equals.
  [[nodiscard]] int owner(const Eigen::Vector2d& point) const;

  /// Sites whose cell is empty in the whole plane, in rising order.
  [[nodiscard]] const std::vector<int>& hidden() const { return triangulation_.hidden(); }

  /// False if the visible sites lie on one line.
  [[nodiscard]] bool is_planar() const { return triangulation_.is_planar(); }

  /// All pairs of sites whose cells share a border in the plane, each once.
  [[nodiscard]] std::vector<std::pair<int, int>> neighbours() const;

  /// All borders between cells, sorted by their sites; `left` is the lower number.
  /// @param reach  how far from the sites' first point an end may lie before it counts as far,
  ///               pixels; several times the picture's and the sites' extent.
  [[nodiscard]] std::vector<DualEdge> dual_edges(double reach, const Executor& executor) const;

  /// Where a point lies among the visible sites: a triangle with barycentric coordinates, or, for a
  /// point outside of their hull, the nearest place on it (at most two coordinates are not 0).
  struct Place {
    std::array<int, 3> sites{};
    Eigen::Vector3d share = Eigen::Vector3d::Zero();
  };
  /// Places of many points; `order` as of spatial_order(points) makes it fast. @pre is_planar().
  [[nodiscard]] std::vector<Place> locate(const Eigen::Matrix2Xd& points,
                                          const std::vector<int>& order) const;

 private:
  PowerDiagram(std::shared_ptr<const Eigen::Matrix2Xd> sites, Eigen::VectorXd weights,
               const std::vector<int>& order, const std::stop_token& stop);

  /// A side of a face whose ends are sites, the first the lower number.
  struct Side {
    int second;
    int face;
    int corner;  ///< Opposite to it.
  };
  [[nodiscard]] std::vector<Side> sorted_sides() const;
  [[nodiscard]] std::vector<DualEdge> parallel_edges(double reach) const;

  std::shared_ptr<const Eigen::Matrix2Xd> sites_;
  Eigen::VectorXd weights_;
  RegularTriangulation triangulation_;
};

}  // namespace lensforge
