// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_queue.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensforge {
namespace {

constexpr double kNothing = 1e-9;  ///< mm and mm/s below which there is no rest.

}  // namespace

SimQueue::SimQueue(const SimSettings& settings, int capacity)
    : settings_(settings), capacity_(capacity) {}

void SimQueue::push(const SimMove& move) {
  Block block;
  block.move = move;
  block.start = blocks_.empty() ? position_ : blocks_.back().move.target;
  block.move.target = on_steps(move.target);
  const Eigen::Vector3d way = block.move.target - block.start;
  block.length = way.norm();
  if (block.length < kNothing) return;
  block.unit = way / block.length;
  block.acceleration = fastest_along(block.unit, 120);
  block.fastest = fastest_along(block.unit, 110) / 60.0;
  block.corner = blocks_.empty() ? 0.0 : corner_speed(blocks_.back(), block);
  blocks_.push_back(block);
  plan();
}

/// The machine knows whole steps only.
Eigen::Vector3d SimQueue::on_steps(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d steps = settings_.axes(100);
  Eigen::Vector3d rounded;
  for (int axis = 0; axis < 3; ++axis) {
    rounded[axis] = std::round(point[axis] * steps[axis]) / steps[axis];
  }
  return rounded;
}

double SimQueue::fastest_along(const Eigen::Vector3d& unit, int first_setting) const {
  double fastest = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis) {
    const double share = std::abs(unit[axis]);
    if (share > 0.0) fastest = std::min(fastest, settings_[first_setting + axis] / share);
  }
  return fastest;
}

/// A circle tangent to both sides that leaves the corner by the junction deviation δ has the
/// radius R = δ·s/(1 − s), where s, the sine of half the angle between the sides, is half the
/// length of the sum of both directions. Its speed is √(aR).
double SimQueue::corner_speed(const Block& before, const Block& block) const {
  const double s = 0.5 * (before.unit + block.unit).norm();
  if (s > 0.9999995) return std::numeric_limits<double>::max();
  if (s < 0.0007) return 0.0;
  const Eigen::Vector3d inward = (block.unit - before.unit).normalized();
  const double radius = settings_[11] * s / (1.0 - s);
  return std::sqrt(fastest_along(inward, 120) * radius);
}

double SimQueue::nominal(const Block& block) const {
  if (block.move.rapid) return block.fastest * rapid_override_;
  return std::min(block.move.feed / 60.0 * feed_override_, block.fastest);
}

/// Every entry as fast as its corner, both its pieces, and the way to the final stop allow.
void SimQueue::plan() {
  double next = 0.0;
  for (std::size_t i = blocks_.size(); i-- > 1;) {
    Block& block = blocks_[i];
    const double limit = std::min({block.corner, nominal(block), nominal(blocks_[i - 1])});
    next = std::min(limit, std::sqrt(next * next + 2.0 * block.acceleration * block.length));
    block.entry = next;
  }
  double speed = speed_;
  double length = blocks_.empty() ? 0.0 : blocks_.front().length - done_;
  for (std::size_t i = 1; i < blocks_.size(); ++i) {
    const double reach = std::sqrt(speed * speed + 2.0 * blocks_[i - 1].acceleration * length);
    blocks_[i].entry = std::min(blocks_[i].entry, reach);
    speed = blocks_[i].entry;
    length = blocks_[i].length;
  }
}

/// The front piece's next phase of motion and its duration.
SimQueue::Phase SimQueue::phase() const {
  const Block& block = blocks_.front();
  const double a = block.acceleration;
  const double left = block.length - done_;
  const double v = speed_;
  if (holding_) {
    const double end_square = v * v - 2.0 * a * left;
    const double end = end_square > 0.0 ? std::sqrt(end_square) : 0.0;
    return {(v - end) / a, -a};
  }
  const double exit = blocks_.size() > 1 ? blocks_[1].entry : 0.0;
  const double cruise = nominal(block);
  const double braking = (v * v - exit * exit) / (2.0 * a);
  if (v > exit && braking >= left - kNothing) return {(v - exit) / a, -a};
  if (v > cruise + kNothing) return {(v - cruise) / a, -a};
  if (v < cruise - kNothing) {
    const double peak = std::sqrt(0.5 * (v * v + exit * exit) + a * left);
    return {(std::min(peak, cruise) - v) / a, a};
  }
  return {(left - std::max(braking, 0.0)) / v, 0.0};
}

double SimQueue::run(double seconds) {
  double used = 0.0;
  while (!blocks_.empty() && used < seconds) {
    if (holding_ && speed_ <= kNothing) {
      speed_ = 0.0;
      break;
    }
    begin_front();
    const Phase next = phase();
    const double step = std::clamp(next.seconds, 0.0, seconds - used);
    const double before = speed_;
    speed_ = std::max(0.0, speed_ + next.acceleration * step);
    done_ += 0.5 * (before + speed_) * step;
    used += step;
    now += step;
    const bool at_end = blocks_.front().length - done_ <= kNothing;
    // A phase of no length that gets nowhere would never end.
    const bool stuck = step <= 0.0 && next.seconds <= 0.0;
    if (at_end || stuck) {
      end_front(true);
      break;
    }
  }
  return used;
}

ExecutedPiece SimQueue::piece_of(const Block& block) const {
  ExecutedPiece piece;
  piece.start = block.start;
  piece.end = block.move.target;
  piece.feed = block.move.rapid ? 0.0 : block.move.feed;
  piece.rapid = block.move.rapid;
  piece.jog = block.move.jog;
  piece.number = block.move.number;
  piece.received = block.move.received;
  piece.spindle = block.spindle;
  piece.rpm = block.rpm;
  piece.begin_time = block.begin_time;
  piece.end_time = now;
  return piece;
}

void SimQueue::begin_front() {
  Block& block = blocks_.front();
  if (block.begun) return;
  block.begun = true;
  block.begin_time = now;
  block.spindle = spindle;
  block.rpm = rpm;
  if (begun) begun(piece_of(block));
}

void SimQueue::end_front(bool complete) {
  const Block block = blocks_.front();
  const Eigen::Vector3d end = complete ? block.move.target : on_steps(position());
  if (ended && (block.begun || complete)) {
    ExecutedPiece piece = piece_of(block);
    piece.end = end;
    piece.complete = complete;
    ended(piece);
  }
  position_ = end;
  done_ = 0.0;
  blocks_.pop_front();
  if (blocks_.empty()) speed_ = 0.0;
}

void SimQueue::finish_now() {
  while (!blocks_.empty()) {
    begin_front();
    end_front(true);
  }
}

void SimQueue::clear() {
  if (!blocks_.empty() && blocks_.front().begun) end_front(false);
  blocks_.clear();
  done_ = 0.0;
  speed_ = 0.0;
  holding_ = false;
}

void SimQueue::resume() {
  holding_ = false;
  plan();
}

void SimQueue::set_overrides(double feed, double rapid) {
  feed_override_ = feed / 100.0;
  rapid_override_ = rapid / 100.0;
  plan();
}

Eigen::Vector3d SimQueue::position() const {
  if (blocks_.empty()) return position_;
  return position_ + blocks_.front().unit * done_;
}

Eigen::Vector3d SimQueue::direction() const {
  return blocks_.empty() || speed_ == 0.0 ? Eigen::Vector3d::Zero() : blocks_.front().unit;
}

}  // namespace lensforge
