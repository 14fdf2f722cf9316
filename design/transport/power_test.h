// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

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

}  // namespace lensforge
