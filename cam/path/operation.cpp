// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/operation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

/// An arc, with a helix's rise: a circle in the plane (u, v) that makes a right-handed frame with
/// its axis.
struct Arc {
  int axis, u, v;
  Eigen::Vector3d begin, end, centre;
  double radius, angle, sweep;

  [[nodiscard]] Eigen::Vector3d at(double part) const {
    if (part >= 1.0) return end;
    Eigen::Vector3d p;
    p[u] = centre[u] + radius * std::cos(angle + part * sweep);
    p[v] = centre[v] + radius * std::sin(angle + part * sweep);
    p[axis] = begin[axis] + part * (end[axis] - begin[axis]);
    return p;
  }
};

Arc arc_of(const Eigen::Vector3d& begin, const PathMove& move) {
  Arc arc{move.arc_axis,
          (move.arc_axis + 1) % 3,
          (move.arc_axis + 2) % 3,
          begin,
          move.end,
          move.centre,
          0.0,
          0.0,
          0.0};
  const auto angle_of = [&](const Eigen::Vector3d& p) {
    return std::atan2(p[arc.v] - arc.centre[arc.v], p[arc.u] - arc.centre[arc.u]);
  };
  arc.radius = std::hypot(begin[arc.u] - arc.centre[arc.u], begin[arc.v] - arc.centre[arc.v]);
  arc.angle = angle_of(begin);
  arc.sweep = angle_of(move.end) - arc.angle;
  const double turn = 2.0 * std::numbers::pi;
  if (move.clockwise && arc.sweep >= 0.0) arc.sweep -= turn;
  if (!move.clockwise && arc.sweep <= 0.0) arc.sweep += turn;
  return arc;
}

}  // namespace

void split_move(const Eigen::Vector3d& begin, const PathMove& move, double length,
                const std::function<void(const MovePiece&)>& take) {
  const bool straight = move.arc_axis < 0;
  const Arc arc = straight ? Arc{} : arc_of(begin, move);
  const double along =
      straight ? (move.end - begin).norm()
               : std::hypot(arc.radius * arc.sweep, move.end[arc.axis] - begin[arc.axis]);
  const double count = std::max(1.0, std::ceil(along / length - 1e-9));
  // Maximum distance of an arc from the chord of a part: r(1 − cos(sweep/2)).
  const double bow = straight ? 0.0 : arc.radius * (1.0 - std::cos(0.5 * arc.sweep / count));
  Eigen::Vector3d from = begin;
  for (double i = 1.0; i <= count; ++i) {
    const Eigen::Vector3d to =
        straight ? Eigen::Vector3d(begin + i / count * (move.end - begin)) : arc.at(i / count);
    take({from, to, std::min(from.z(), to.z()) - bow, 0.5 * (to - from).head<2>().norm() + bow});
    from = to;
  }
}

}  // namespace lensforge
