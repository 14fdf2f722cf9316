// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/planner/plan_timeline.h"

#include <algorithm>
#include <cmath>

#include "machine/planner/speed_profile.h"

namespace lensforge {

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

/// Backward from the new end: v² ≤ v_next² + 2as; then forward from where nothing changed. The
/// first piece is running: its entry is what it is.
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

/// What is left of the running piece is planned anew with whatever arrives.
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

}  // namespace lensforge
