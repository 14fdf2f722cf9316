// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "design/transport/power_test.h"

namespace lensforge {

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

}  // namespace lensforge
