// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/ball_sweep.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kLongestSweep = 2.0 * std::numbers::pi / 3.0;

/// Direction of travel along the arc, of any length.
Eigen::Vector3d direction_at(const Arc& arc, double part) {
  const double angle = arc.begin + part * arc.sweep;
  const double turn = arc.sweep < 0.0 ? -1.0 : 1.0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  direction[arc.first] = -turn * std::sin(angle);
  direction[arc.second] = turn * std::cos(angle);
  return direction;
}

/// Number of chords that stay within kHelixError of a helix: a chord of angle φ is off by r φ²/8.
int chords_of(const Arc& helix) {
  const double angle = std::sqrt(8.0 * BallPath::kHelixError / helix.radius);
  return std::max(1, static_cast<int>(std::ceil(std::abs(helix.sweep) / angle)));
}

}  // namespace

Arc part_of(const Arc& arc, double from, double to) {
  Arc part = arc;
  part.begin = arc.begin + from * arc.sweep;
  part.sweep = (to - from) * arc.sweep;
  part.rise = 0.0;
  return part;
}

BallPath::BallPath(double radius, double z_offset) : radius_(radius), lift_(radius - z_offset) {
  LF_CHECK(radius > 0.0, std::to_string(radius));
}

void BallPath::add(const GcodeMotion& motion) {
  const Eigen::Vector3d lift(0.0, 0.0, lift_);
  if (!motion.arc) {
    add_straight(motion.start + lift, motion.end + lift);
    return;
  }
  Arc arc = *motion.arc;
  arc.centre += lift;
  if (arc.rise == 0.0) {
    add_arc(arc);
    return;
  }
  const int chords = chords_of(arc);
  for (int k = 0; k < chords; ++k)
    add_straight(arc.at(k / double(chords)), arc.at((k + 1) / double(chords)));
}

void BallPath::add_straight(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  add_move({start, end}, end - start, end - start);
}

void BallPath::add_arc(const Arc& arc) {
  const int parts = std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep) / kLongestSweep)));
  for (int k = 0; k < parts; ++k) {
    const Arc part = part_of(arc, k / double(parts), (k + 1) / double(parts));
    BallMove move{part.at(0.0), part.at(1.0)};
    move.arc = static_cast<std::int32_t>(arcs_.size());
    arcs_.push_back(part);
    add_move(move, direction_at(part, 0.0), direction_at(part, 1.0));
  }
}

BallPath::Tangent BallPath::make_tangent(const Eigen::Vector3d& direction) {
  const double run = direction.head<2>().norm();
  Tangent tangent;
  if (run > 0.0) tangent.heading = direction.head<2>() / run;
  tangent.incline = std::atan2(direction.z(), run);
  return tangent;
}

void BallPath::add_move(BallMove move, const Eigen::Vector3d& begin, const Eigen::Vector3d& end) {
  const Tangent at_begin = make_tangent(begin);
  const Tangent at_end = make_tangent(end);
  const double length = (move.end - move.start).norm();
  const bool ridge = rolls_over_ridge(move);
  if (ridge || after_ridge_ || begins_piece(move, at_begin, at_end, length)) {
    ++piece_;
    piece_heading_ = at_begin.heading;
  }
  move.piece = piece_;
  moves_.push_back(move);
  last_ = at_end;
  last_length_ = length;
  after_ridge_ = ridge;
}

bool BallPath::begins_piece(const BallMove& move, const Tangent& begin, const Tangent& end,
                            double length) const {
  if (moves_.empty()) return true;
  constexpr double kBroken = 0.01;  // mm: the error of an arc's end against its circle is no break.
  if ((move.start - moves_.back().end).norm() > kBroken) return true;
  constexpr double kTurned = 0.5;  // cos 60°
  if (piece_heading_.dot(begin.heading) < kTurned || piece_heading_.dot(end.heading) < kTurned) {
    return true;
  }
  const double bend = last_.incline - begin.incline;
  const double way = 0.5 * (last_length_ + length);
  return bend > kRidgeAngle || bend * (radius_ + kRidgeRadius) > way;
}

/// True for an arc above its centre that is about as tight as the ball: what the ball leaves under
/// it is almost only the ridge itself.
bool BallPath::rolls_over_ridge(const BallMove& move) const {
  if (move.arc < 0) return false;
  const Arc& arc = arcs_[static_cast<std::size_t>(move.arc)];
  return arc.third != 2 && arc.radius < radius_ + kRidgeRadius && arc.at(0.5).z() > arc.centre.z();
}

namespace {

/// The deepest of several balls.
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

/// Zeros of the derivative. In a horizontal plane: the point of the circle nearest to q. In a
/// vertical one: the line from the arc's centre through the ball's meets the circle of radius r at
/// a right angle, so q lies under the ball at the distance ρ + r from the arc's centre where the
/// path runs below it, and at ρ − r where it runs above; the ball is ρ/(ρ ± r) as far out as q.
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
