// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/planner/planner_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

double positive(const std::map<int, double>& settings, int number) {
  const auto found = settings.find(number);
  if (found == settings.end()) {
    throw InputError(std::string("$") + std::to_string(number) +
                     ": the controller did not report it");
  }
  if (!(found->second > 0.0)) {
    throw InputError(std::string("$") + std::to_string(number) + "=" +
                     std::to_string(found->second) + ": must be above 0");
  }
  return found->second;
}

Eigen::Vector3d positive_axes(const std::map<int, double>& settings, int first) {
  return {positive(settings, first), positive(settings, first + 1), positive(settings, first + 2)};
}

}  // namespace

PlannerSettings planner_settings(const std::map<int, double>& settings) {
  PlannerSettings read;
  read.junction_deviation = positive(settings, 11);
  read.arc_tolerance = positive(settings, 12);
  read.steps_per_mm = positive_axes(settings, 100);
  read.max_rate = positive_axes(settings, 110);
  read.acceleration = positive_axes(settings, 120);
  return read;
}

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

/// With up and down ramps that meet, the peak follows from v² = v0² + 2as on both:
/// peak² = a·length + (entry² + exit²)/2.
SpeedProfile::SpeedProfile(double length, double entry, double exit, double nominal,
                           double acceleration)
    : length_(length), entry_(entry), exit_(exit), acceleration_(acceleration) {
  const double triangle = std::sqrt(acceleration * length + 0.5 * (entry * entry + exit * exit));
  peak_ = std::max({std::min(triangle, nominal), entry, exit});
  up_ = (peak_ - entry) / acceleration;
  down_ = (peak_ - exit) / acceleration;
  const double ramps = 0.5 * (entry + peak_) * up_ + 0.5 * (exit + peak_) * down_;
  along_ = peak_ > 0.0 ? std::max(0.0, length - ramps) / peak_ : 0.0;
}

ProfilePoint SpeedProfile::at(double time) const {
  ProfilePoint point;
  if (time < up_) {
    point.speed = entry_ + acceleration_ * time;
    point.distance = 0.5 * (entry_ + point.speed) * time;
  } else if (time < up_ + along_) {
    point.speed = peak_;
    point.distance = 0.5 * (entry_ + peak_) * up_ + peak_ * (time - up_);
  } else {
    const double left = std::max(0.0, duration() - time);
    point.speed = exit_ + acceleration_ * left;
    point.distance = length_ - 0.5 * (exit_ + point.speed) * left;
  }
  point.distance = std::clamp(point.distance, 0.0, length_);
  return point;
}

PlanTimeline::PlanTimeline(int blocks) : ring_(static_cast<std::size_t>(std::max(blocks, 2))) {}

void PlanTimeline::push(const PlanBlock& block) {
  if (size_ == ring_.size()) {
    // The controller takes the next piece only when the running one has made room for it.
    arrival_ = std::max(arrival_, time_ + first_duration());
  }
  run_until(arrival_);
  if (size_ == 0) {
    if (interrupted_ && block.max_entry_square > 0.0) ++starved_;
    time_ = std::max(time_, arrival_);
  }
  Entry& entry = at(size_);
  entry.block = block;
  entry.reachable_square = entry.entry_square = 0.0;
  if (size_ == 0) entry.block.max_entry_square = 0.0;
  ++size_;
  interrupted_ = true;
  plan();
}

void PlanTimeline::stand(double seconds) {
  while (size_ > 0) {
    time_ += first_duration();
    pop();
  }
  time_ = std::max(time_, arrival_) + seconds;
  arrival_ = time_;
  interrupted_ = false;
}

/// Backward from the new end: v² ≤ v_next² + 2as; then forward from the first change. The first
/// piece is running: its entry is fixed.
void PlanTimeline::plan() {
  std::size_t changed = size_ - 1;
  double next = 0.0;
  for (std::size_t i = size_ - 1; i > 0; --i) {
    Entry& entry = at(i);
    const double reach = next + 2.0 * entry.block.acceleration * entry.block.length;
    const double square = std::min(entry.block.max_entry_square, reach);
    const bool same = i + 1 < size_ && square == entry.reachable_square;
    if (same) break;
    entry.reachable_square = next = square;
    changed = i;
  }
  for (std::size_t i = std::max<std::size_t>(changed, 1); i < size_; ++i) {
    const Entry& before = at(i - 1);
    const double reach =
        before.entry_square + 2.0 * before.block.acceleration * before.block.length;
    at(i).entry_square = std::min(at(i).reachable_square, reach);
  }
}

double PlanTimeline::first_duration() {
  const Entry& entry = at(0);
  const double exit = size_ > 1 ? std::sqrt(at(1).entry_square) : 0.0;
  return SpeedProfile(entry.block.length, std::sqrt(entry.entry_square), exit, entry.block.nominal,
                      entry.block.acceleration)
      .duration();
}

void PlanTimeline::run_until(double time) {
  while (size_ > 0 && time_ < time) {
    const double duration = first_duration();
    if (time_ + duration > time) return run_part(time - time_);
    time_ += duration;
    pop();
  }
}

/// The rest of the running piece is planned again when pieces arrive.
void PlanTimeline::run_part(double seconds) {
  Entry& entry = at(0);
  const double exit = size_ > 1 ? std::sqrt(at(1).entry_square) : 0.0;
  const ProfilePoint point = SpeedProfile(entry.block.length, std::sqrt(entry.entry_square), exit,
                                          entry.block.nominal, entry.block.acceleration)
                                 .at(seconds);
  entry.block.length -= point.distance;
  entry.entry_square = point.speed * point.speed;
  time_ += seconds;
}

void PlanTimeline::pop() {
  first_ = (first_ + 1) % ring_.size();
  --size_;
}

namespace {

double line_seconds(const PlannerSettings& settings, std::size_t bytes) {
  double seconds = 0.0;
  if (settings.lines_per_second > 0.0) seconds = 1.0 / settings.lines_per_second;
  if (settings.bytes_per_second > 0.0) {
    seconds = std::max(seconds, static_cast<double>(bytes) / settings.bytes_per_second);
  }
  return seconds;
}

}  // namespace

PlannerModel::PlannerModel(const PlannerSettings& settings)
    : settings_(settings),
      pieces_(settings),
      free_(settings.blocks),
      limited_(settings.blocks),
      recent_(static_cast<std::size_t>(std::max(settings.blocks, 2))) {}

void PlannerModel::line(std::size_t bytes) {
  bytes_ += static_cast<std::int64_t>(bytes);
  limited_.line(line_seconds(settings_, bytes));
}

void PlannerModel::add(const GcodeMotion& motion) {
  result_.length += motion.length();
  ++result_.motions;
  pieces_.split(motion, [this](const PlanBlock& block) {
    free_.push(block);
    limited_.push(block);
    ++result_.blocks;
  });
  note_demand(motion.line);
}

/// A full queue accepts a line when a piece has run: this is the rate at which lines are needed.
/// Lines that fill an empty queue can wait.
void PlannerModel::note_demand(std::int64_t line) {
  if (!free_.full()) return;
  Demand& oldest = recent_[noted_ % recent_.size()];
  const double seconds = free_.time() - oldest.time;
  if (noted_ >= recent_.size() && seconds > 0.0) {
    const double lines = static_cast<double>(recent_.size()) / seconds;
    const double bytes = static_cast<double>(bytes_ - oldest.bytes) / seconds;
    if (lines > result_.peak_lines_per_second) result_.peak_line = line;
    result_.peak_lines_per_second = std::max(result_.peak_lines_per_second, lines);
    result_.peak_bytes_per_second = std::max(result_.peak_bytes_per_second, bytes);
  }
  oldest = {free_.time(), bytes_};
  ++noted_;
}

void PlannerModel::wait(double seconds) {
  free_.stand(seconds);
  limited_.stand(seconds);
  pieces_.stand_still();
  noted_ = 0;
}

PlanTime PlannerModel::finish() {
  wait(0.0);
  result_.seconds = free_.time();
  result_.stream_limited_seconds = limited_.time();
  result_.starved = limited_.starved();
  return result_;
}

}  // namespace lensforge
