// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/planner/motion_blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensforge {
namespace {

/// Corners sharper or flatter than this count as a reversal or as none (Grbl 1.1's own bound).
constexpr double kStraightCosine = 0.999999;

/// The largest value along `unit` that keeps every axis within `limits`.
double along(const Eigen::Vector3d& unit, const Eigen::Vector3d& limits) {
  double least = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (unit[axis] != 0.0) least = std::min(least, limits[axis] / std::abs(unit[axis]));
  }
  return least;
}

}  // namespace

/// A chord over the angle 2φ leaves the circle by r(1 − cos φ); the controller takes
/// sin φ = √(t(2r − t))/r for φ and rounds down.
int arc_chords(double radius, double sweep, double tolerance) {
  const double half = 0.5 * std::abs(sweep) * radius;
  const double reach = tolerance * (2.0 * radius - tolerance);
  if (reach <= 0.0) return 1;
  return std::max(1, static_cast<int>(std::floor(half / std::sqrt(reach))));
}

MotionBlocks::MotionBlocks(const PlannerSettings& settings)
    : settings_(settings), rate_(settings.max_rate / 60.0) {}

void MotionBlocks::split(const GcodeMotion& motion,
                         const std::function<void(const PlanBlock&)>& take) {
  if (!placed_) position_ = on_steps(motion.start);
  placed_ = true;
  const int chords =
      motion.arc ? arc_chords(motion.arc->radius, motion.arc->sweep, settings_.arc_tolerance) : 1;
  const double speed = motion.rapid ? std::numeric_limits<double>::infinity() : motion.feed / 60.0;
  PlanBlock block;
  block.line = motion.line;
  block.begins_line = true;
  for (int chord = 1; chord <= chords; ++chord) {
    const bool last = chord == chords;
    const Piece piece{last ? motion.end : motion.arc->at(double(chord) / chords), speed};
    if (!make_block(piece, block)) continue;
    take(block);
    block.begins_line = false;
  }
}

bool MotionBlocks::make_block(const Piece& piece, PlanBlock& block) {
  const Eigen::Vector3d end = on_steps(piece.end);
  const Eigen::Vector3d delta = end - position_;
  block.length = delta.norm();
  if (block.length == 0.0) return false;
  const Eigen::Vector3d unit = delta / block.length;
  block.acceleration = along(unit, settings_.acceleration);
  block.nominal = std::min(piece.speed, along(unit, rate_));
  block.max_entry_square = moving_ ? max_entry_square(unit, block.nominal) : 0.0;
  position_ = end;
  previous_unit_ = unit;
  previous_nominal_ = block.nominal;
  moving_ = true;
  return true;
}

/// Junction deviation δ: a circle that touches both sides of the corner and passes it at δ, run
/// with the centripetal acceleration a: v² = a·δ·s/(1 − s), s = sin(θ/2), θ the angle between the
/// sides (S. Jeon, "Improving Grbl: cornering algorithm", 2011).
double MotionBlocks::max_entry_square(const Eigen::Vector3d& unit, double nominal) const {
  const double slower = std::min(nominal, previous_nominal_);
  const double cosine = -previous_unit_.dot(unit);
  if (cosine > kStraightCosine) return 0.0;
  if (cosine < -kStraightCosine) return slower * slower;
  const double acceleration = along((unit - previous_unit_).normalized(), settings_.acceleration);
  const double sine = std::sqrt(0.5 * (1.0 - cosine));
  const double corner = acceleration * settings_.junction_deviation * sine / (1.0 - sine);
  return std::min(corner, slower * slower);
}

Eigen::Vector3d MotionBlocks::on_steps(const Eigen::Vector3d& point) const {
  Eigen::Vector3d rounded = point;
  for (int axis = 0; axis < 3; ++axis) {
    const double steps = settings_.steps_per_mm[axis];
    if (steps > 0.0) rounded[axis] = std::round(point[axis] * steps) / steps;
  }
  return rounded;
}

}  // namespace lensforge
