// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_test.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <array>
#include <tuple>

namespace lensforge {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

}  // namespace

int side_of_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  const double left = (b.x() - a.x()) * (p.y() - a.y());
  const double right = (b.y() - a.y()) * (p.x() - a.x());
  // Shewchuk 1997, orient2d: (3 + 16ε) ε; the tiny number covers underflow.
  const double error = 4.0 * 0x1p-53 * (std::fabs(left) + std::fabs(right)) + 1e-290;
  if (std::fabs(left - right) > error) return left > right ? 1 : -1;
  using Point = Kernel::Point_2;
  return static_cast<int>(
      CGAL::orientation(Point(a.x(), a.y()), Point(b.x(), b.y()), Point(p.x(), p.y())));
}

bool PowerTest::is_below_exactly(int a, int b, int c, int p) const {
  const auto point = [&](int i) {
    return Kernel::Weighted_point_2({sites_(0, i), sites_(1, i)}, weights_[i]);
  };
  const CGAL::Oriented_side side = Kernel().power_side_of_oriented_power_circle_2_object()(
      point(a), point(b), point(c), point(p));
  if (side != CGAL::ON_ORIENTED_BOUNDARY) return side == CGAL::ON_POSITIVE_SIDE;
  // The perturbation of the last site in lexicographic order counts most; one of two decides.
  std::array<int, 4> order{a, b, c, p};
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    return std::tuple(sites_(0, i), sites_(1, i)) < std::tuple(sites_(0, j), sites_(1, j));
  });
  for (const int last : {order[3], order[2]}) {
    if (last == p) return false;
    const auto with_p = [&](int i) { return sites_.col(i == last ? p : i); };
    const int turn = side_of_line(with_p(a), with_p(b), with_p(c));
    if (turn != 0) return turn > 0;
  }
  return false;
}

}  // namespace lensforge
