// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge {

/// Exact sign of (b − a) × (p − a): +1 if p lies to the left of a → b, 0 if on the line.
int side_of_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p);

/// Exact predicates on sites c with weights w, lifted to heights h = |c|² − w: their lower hull is
/// the regular triangulation. Neither sites nor weights are copied.
class PowerTest {
 public:
  PowerTest(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights)
      : sites_(sites), weights_(weights) {}

  [[nodiscard]] bool is_counterclockwise(int a, int b, int c) const {
    return side_of_line(sites_.col(a), sites_.col(b), sites_.col(c)) > 0;
  }

  /// True if the lifted p lies below the plane through the lifted a, b and c. Where it lies in the
  /// plane, heights are thought to be perturbed as in CGAL's Regular_triangulation_2, so that every
  /// set of sites and weights has one triangulation (Devillers & Teillaud 2011).
  /// @pre a, b, c run counterclockwise.
  [[nodiscard]] bool is_below(int a, int b, int c, int p) const {
    const Lifted u = lifted(a, p);
    const Lifted v = lifted(b, p);
    const Lifted w = lifted(c, p);
    const double vw = v.x * w.y;
    const double wv = w.x * v.y;
    const double wu = w.x * u.y;
    const double uw = u.x * w.y;
    const double uv = u.x * v.y;
    const double vu = v.x * u.y;
    const double sum = u.height * (vw - wv) + v.height * (wu - uw) + w.height * (uv - vu);
    const double size = u.size * (std::fabs(vw) + std::fabs(wv)) +
                        v.size * (std::fabs(wu) + std::fabs(uw)) +
                        w.size * (std::fabs(uv) + std::fabs(vu));
    if (std::fabs(sum) > kRounding * size + kTiny) return sum > 0.0;
    return is_below_exactly(a, b, c, p);
  }

 private:
  /// Rounding of the sum, at most 12 · 2⁻⁵³ of the sum of the terms' sizes: 5 from a height, 4 from
  /// a difference of products, 3 from the last product and sums; 16 leaves room for squares of it.
  static constexpr double kRounding = 16.0 * 0x1p-53;
  /// Above what is lost where products underflow.
  static constexpr double kTiny = 1e-290;

  /// A site and its height as seen from another one.
  struct Lifted {
    double x;
    double y;
    double height;
    double size;  ///< Of the terms of the height.
  };
  [[nodiscard]] Lifted lifted(int i, int origin) const {
    const double x = sites_(0, i) - sites_(0, origin);
    const double y = sites_(1, i) - sites_(1, origin);
    const double squared = x * x + y * y;
    const double weight = weights_[i] - weights_[origin];
    return {x, y, squared - weight, squared + std::fabs(weight)};
  }

  [[nodiscard]] bool is_below_exactly(int a, int b, int c, int p) const;

  const Eigen::Matrix2Xd& sites_;
  const Eigen::VectorXd& weights_;
};

/// A triangle, counterclockwise; side k and neighbour k lie opposite to vertex k. Triangles beyond
/// the hull have the vertex kAtInfinity.
struct TriangleFace {
  static constexpr int kAtInfinity = -1;

  std::array<int, 3> vertex;
  std::array<int, 3> neighbour;

  [[nodiscard]] bool is_finite() const {
    return vertex[0] >= 0 && vertex[1] >= 0 && vertex[2] >= 0;
  }
  /// The ends of side k, first and second as seen from inside.
  [[nodiscard]] int first(std::size_t k) const { return vertex[(k + 1) % 3]; }
  [[nodiscard]] int second(std::size_t k) const { return vertex[(k + 2) % 3]; }
};

/// The regular triangulation of sites c with weights w: the lower hull of the points
/// (c, |c|² − w), seen from below, by exact predicates. Ties are broken as by PowerTest.
class RegularTriangulation {
 public:
  /// Inserts site by site, by CGAL. @throw Interrupted
  RegularTriangulation(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                       const std::vector<int>& order, const std::stop_token& stop);

  /// Goes over to other weights by flips of sides (Lawson), which serve as long as every site has
  /// a cell: a side that has to go but cannot be flipped proves that one of its ends has none. Such
  /// a site's weight is raised until it lies below the triangle around by half as much as before.
  /// @param before   the weights of this triangulation.
  /// @param weights  the new ones.
  /// @param max_raises  how often that may be done.
  /// @pre is_planar(), none hidden. @return false if a site has no cell any more; then this is of
  /// no further use. @throw Interrupted
  [[nodiscard]] bool reweight(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& before,
                              Eigen::VectorXd& weights, int max_raises, const Executor& executor);

  /// False if the visible sites lie on one line; then there are no faces.
  [[nodiscard]] bool is_planar() const { return !faces_.empty(); }
  [[nodiscard]] const std::vector<TriangleFace>& faces() const { return faces_; }
  /// Visible sites that are neighbours on their line, in its order, if not planar.
  [[nodiscard]] const std::vector<std::pair<int, int>>& line() const { return line_; }
  /// Sites whose cell is empty in the whole plane, in rising order.
  [[nodiscard]] const std::vector<int>& hidden() const { return hidden_; }

 private:
  struct Side {
    std::int32_t face;
    std::int32_t corner;
  };

  /// A site and the triangle it lies in, whose lifted corners are not above it.
  struct HiddenSite {
    int site;
    std::array<int, 3> around;
  };

  [[nodiscard]] std::vector<Side> improper_sides(const PowerTest& test,
                                                 const Executor& executor) const;
  [[nodiscard]] bool is_proper(const PowerTest& test, std::size_t f, std::size_t k) const;
  [[nodiscard]] bool can_flip(const PowerTest& test, std::size_t f, std::size_t k) const;
  [[nodiscard]] std::size_t corner_towards(std::size_t f, int neighbour) const;
  void flip(std::size_t f, std::size_t k);
  [[nodiscard]] HiddenSite hidden_by(const PowerTest& test, std::size_t f, std::size_t k) const;
  void append_star(std::size_t f, int site, std::vector<Side>& sides) const;

  std::vector<TriangleFace> faces_;
  std::vector<std::pair<int, int>> line_;
  std::vector<int> hidden_;
};

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
