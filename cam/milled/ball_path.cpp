// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/ball_path.h"

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

/// So many chords stay within kHelixError of a helix: a chord of angle φ is off by r φ²/8.
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
  constexpr double kBroken = 0.01;  // mm: what an arc's end may be off its circle is no break.
  if ((move.start - moves_.back().end).norm() > kBroken) return true;
  constexpr double kTurned = 0.5;  // cos 60°
  if (piece_heading_.dot(begin.heading) < kTurned || piece_heading_.dot(end.heading) < kTurned) {
    return true;
  }
  const double bend = last_.incline - begin.incline;
  const double way = 0.5 * (last_length_ + length);
  return bend > kRidgeAngle || bend * (radius_ + kRidgeRadius) > way;
}

/// True for an arc that lies above its centre and is about as tight as the ball: what the ball
/// leaves under it is next to nothing, the ridge itself.
bool BallPath::rolls_over_ridge(const BallMove& move) const {
  if (move.arc < 0) return false;
  const Arc& arc = arcs_[static_cast<std::size_t>(move.arc)];
  return arc.third != 2 && arc.radius < radius_ + kRidgeRadius && arc.at(0.5).z() > arc.centre.z();
}

}  // namespace lensforge
