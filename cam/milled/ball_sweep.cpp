// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/ball_sweep.h"

#include <cmath>

namespace lensforge {
namespace {

/// The deepest of the balls offered.
struct Deepest {
  double radius, x, y;
  Eigen::Vector3d centre;
  double z;

  void offer(const Eigen::Vector3d& candidate) {
    const double at = ball_below(candidate, radius, x, y);
    if (at >= z) return;
    z = at;
    centre = candidate;
  }
};

}  // namespace

ArcSweep::ArcSweep(const Arc& arc)
    : first_(arc.first),
      second_(arc.second),
      third_(arc.third),
      centre_(arc.centre),
      radius_(arc.radius),
      turn_(arc.sweep < 0.0 ? -1.0 : 1.0),
      begin_(radius_ * std::cos(arc.begin), radius_ * std::sin(arc.begin)),
      end_(radius_ * std::cos(arc.begin + arc.sweep), radius_ * std::sin(arc.begin + arc.sweep)) {}

/// True for a direction between those of the start and the end.
bool ArcSweep::contains(double first, double second) const {
  return turn_ * (begin_.x() * second - begin_.y() * first) >= 0.0 &&
         turn_ * (first * end_.y() - second * end_.x()) >= 0.0;
}

Eigen::Vector3d ArcSweep::point(double first, double second) const {
  Eigen::Vector3d p = centre_;
  p[first_] += first;
  p[second_] += second;
  return p;
}

std::optional<GraphArc> ArcSweep::graph(double radius) const {
  constexpr double kFlatter = 1.001;  // Well away from r = ρ, where a cap's feet run together.
  if (third_ == 2 || radius_ < kFlatter * radius) return std::nullopt;
  const bool z_first = first_ == 2;
  const double begin_up = z_first ? begin_.x() : begin_.y();
  const double end_up = z_first ? end_.x() : end_.y();
  if (!(begin_up * end_up > 0.0)) return std::nullopt;
  const double begin = z_first ? begin_.y() : begin_.x();
  const double end = z_first ? end_.y() : end_.x();
  GraphArc arc{third_ == 1, centre_.x(), centre_.y(), centre_.z(), radius_};
  arc.side = begin_up > 0.0 ? 1.0 : -1.0;
  arc.low = std::min(begin, end);
  arc.high = std::max(begin, end);
  return arc;
}

/// Zeros of the derivative. In a horizontal plane: the point of the circle that is nearest to q. In
/// a vertical one: the line from the arc's centre through the ball's meets the circle of radius r
/// at a right angle, so q lies under the ball at the distance ρ + r from the arc's centre where the
/// way runs below it, and at ρ − r where it runs above; the ball is ρ/(ρ ± r) as far out as q.
Eigen::Vector3d ArcSweep::centre(double radius, double qx, double qy) const {
  const Eigen::Vector3d start = point(begin_.x(), begin_.y());
  Deepest deepest{radius, qx, qy, start, ball_below(start, radius, qx, qy)};
  deepest.offer(point(end_.x(), end_.y()));
  if (third_ == 2) {
    const double dx = qx - centre_.x();
    const double dy = qy - centre_.y();
    const double distance = std::sqrt(dx * dx + dy * dy);
    if (distance > 0.0 && contains(dx, dy)) {
      deepest.offer(point(dx * (radius_ / distance), dy * (radius_ / distance)));
    }
    return deepest.centre;
  }
  const double w = (third_ == 0 ? qx : qy) - centre_[third_];
  const double out = third_ == 0 ? qy - centre_.y() : qx - centre_.x();
  const double r = std::sqrt(std::max(radius * radius - w * w, 0.0));
  for (const double side : {-1.0, 1.0}) {
    const double h = out * radius_ / (radius_ - side * r);
    if (!(std::abs(h) <= radius_)) continue;
    const double v = side * std::sqrt(radius_ * radius_ - h * h);
    const double first = first_ == 2 ? v : h;
    const double second = first_ == 2 ? h : v;
    if (contains(first, second)) deepest.offer(point(first, second));
  }
  return deepest.centre;
}

}  // namespace lensforge
