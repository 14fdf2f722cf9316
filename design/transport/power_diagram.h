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

/// Exact predicates on sites c with weights w, lifted to heights h = |c|² − w; their lower hull is
/// the regular triangulation. Refers to sites and weights, which must outlive it.
class PowerTest {
 public:
  PowerTest(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights)
      : sites_(sites), weights_(weights) {}

  [[nodiscard]] bool is_counterclockwise(int a, int b, int c) const {
    return side_of_line(sites_.col(a), sites_.col(b), sites_.col(c)) > 0;
  }

  /// True if the lifted p lies below the plane through the lifted a, b and c. If it lies in the
  /// plane, heights are perturbed symbolically as in CGAL's Regular_triangulation_2, so that every
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
  /// Bound of the sum's rounding, as a share of the sum of the terms' sizes. It is at most 12 ·
  /// 2⁻⁵³: 5 from a height, 4 from a difference of products, 3 from the last product and sums; 16
  /// leaves room for second-order terms.
  static constexpr double kRounding = 16.0 * 0x1p-53;
  /// Bound of what underflow of products loses.
  static constexpr double kTiny = 1e-290;

  /// A site and its height relative to another site.
  struct Lifted {
    double x;
    double y;
    double height;
    double size;  ///< Sum of the sizes of the height's terms.
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
  /// Ends of side k, as seen from inside.
  [[nodiscard]] int first(std::size_t k) const { return vertex[(k + 1) % 3]; }
  [[nodiscard]] int second(std::size_t k) const { return vertex[(k + 2) % 3]; }
};

/// The regular triangulation of sites c with weights w: the lower hull of the points
/// (c, |c|² − w), seen from below, by exact predicates. Ties are broken as by PowerTest.
class RegularTriangulation {
 public:
  /// Inserts site by site, with CGAL. @throw Interrupted
  RegularTriangulation(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                       const std::vector<int>& order, const std::stop_token& stop);

  /// Changes to other weights by flips of sides (Lawson). This works as long as every site has a
  /// cell: a side that has to go but cannot be flipped proves that one of its ends has none. Such a
  /// site's weight is raised until the site lies half as far below the triangle around it as
  /// before.
  /// @param before      the weights of this triangulation.
  /// @param weights     the new weights; raised for sites that would be hidden.
  /// @param max_raises  maximum number of raises.
  /// @pre is_planar(), none hidden. @return false if a site still has no cell; the triangulation is
  /// then unusable. @throw Interrupted
  [[nodiscard]] bool reweight(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& before,
                              Eigen::VectorXd& weights, int max_raises, const Executor& executor);

  /// False if the visible sites lie on one line; then there are no faces.
  [[nodiscard]] bool is_planar() const { return !faces_.empty(); }
  [[nodiscard]] const std::vector<TriangleFace>& faces() const { return faces_; }
  /// Pairs of visible sites that are neighbours on their line, in its order; empty if planar.
  [[nodiscard]] const std::vector<std::pair<int, int>>& line() const { return line_; }
  /// Sites whose cell is empty in the whole plane, in rising order.
  [[nodiscard]] const std::vector<int>& hidden() const { return hidden_; }

 private:
  struct Side {
    std::int32_t face;
    std::int32_t corner;
  };

  /// A site and the triangle it lies in, whose lifted corners are not above the site.
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

/// The border between two power cells, directed so that the cell of `left` lies on its left (x to
/// the right, y "up"). Ends near the picture are exact to rounding; a far end is moved along the
/// edge to a point far outside.
struct DualEdge {
  int left;
  int right;
  Eigen::Vector2d from;
  Eigen::Vector2d to;
};

/// Order in which sites are inserted and walked: neighbours in the order are neighbours in the
/// plane. It depends only on the sites, so one order serves all weights.
std::vector<int> spatial_order(const Eigen::Matrix2Xd& sites);

/// The power diagram of sites c with weights w, {x : |x − c_i|² − w_i ≤ |x − c_j|² − w_j for all j}
/// (Sun et al. 3.4), as the dual of the regular triangulation. Its edges depend only on sites and
/// weights, to the bit.
class PowerDiagram {
 public:
  /// @param sites    2 × n, all different.
  /// @param weights  n, finite.
  /// @param order    spatial_order(sites).
  /// @pre n ≥ 1. @throw Interrupted within a few thousand insertions after `stop` is requested.
  PowerDiagram(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
               const std::vector<int>& order, const std::stop_token& stop);

  /// Returns the diagram of the same sites with other weights, in a fraction of the time if weights
  /// change little: by flips in this diagram's triangulation, if it hides no site. The weight of a
  /// site that would be hidden is raised, up to `max_raises` times: the site then lies half as far
  /// below a triangle around it as in this diagram.
  /// @return nothing if a site would still be hidden. @throw Interrupted
  [[nodiscard]] std::optional<PowerDiagram> reweighted(const Eigen::VectorXd& weights,
                                                       const std::vector<int>& order,
                                                       const Executor& executor,
                                                       int max_raises = 0) const;

  [[nodiscard]] const Eigen::Matrix2Xd& sites() const { return *sites_; }
  [[nodiscard]] const Eigen::VectorXd& weights() const { return weights_; }

  /// The site whose cell holds a point, found by comparing all; the first of equals.
  [[nodiscard]] int owner(const Eigen::Vector2d& point) const;

  /// Sites whose cell is empty in the whole plane, in rising order.
  [[nodiscard]] const std::vector<int>& hidden() const { return triangulation_.hidden(); }

  /// False if the visible sites lie on one line.
  [[nodiscard]] bool is_planar() const { return triangulation_.is_planar(); }

  /// All pairs of sites whose cells share a border in the plane, each once.
  [[nodiscard]] std::vector<std::pair<int, int>> neighbours() const;

  /// All borders between cells, sorted by their sites; `left` is the lower number.
  /// @param reach  distance from the sites' first point beyond which an end counts as far, pixels;
  ///               several times the picture's and the sites' extent.
  [[nodiscard]] std::vector<DualEdge> dual_edges(double reach, const Executor& executor) const;

  /// Location of a point among the visible sites: a triangle with barycentric coordinates, or for a
  /// point outside their hull the nearest point of the hull (at most two coordinates are not 0).
  struct Place {
    std::array<int, 3> sites{};
    Eigen::Vector3d share = Eigen::Vector3d::Zero();
  };
  /// Places of many points; fast if `order` is spatial_order(points). @pre is_planar().
  [[nodiscard]] std::vector<Place> locate(const Eigen::Matrix2Xd& points,
                                          const std::vector<int>& order) const;

 private:
  PowerDiagram(std::shared_ptr<const Eigen::Matrix2Xd> sites, Eigen::VectorXd weights,
               const std::vector<int>& order, const std::stop_token& stop);

  /// A side of a face between two sites, the first with the lower number.
  struct Side {
    int second;
    int face;
    int corner;  ///< Opposite to the side.
  };
  [[nodiscard]] std::vector<Side> sorted_sides() const;
  [[nodiscard]] std::vector<DualEdge> parallel_edges(double reach) const;

  std::shared_ptr<const Eigen::Matrix2Xd> sites_;
  Eigen::VectorXd weights_;
  RegularTriangulation triangulation_;
};

}  // namespace lensforge
