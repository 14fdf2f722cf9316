// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "machine/planner/motion_blocks.h"

namespace lensforge {

/// A controller's queue of motions on a time axis: pieces arrive, are planned as far as they are
/// known (the last of them ends at a standstill), and run. Memory for `blocks` pieces.
class PlanTimeline {
 public:
  /// @param blocks  pieces that the queue holds, the running one included; at least 2.
  explicit PlanTimeline(int blocks);

  /// A line takes `seconds` to arrive before what it says can be queued.
  void line(double seconds) { arrival_ += seconds; }
  /// Queues a piece that has arrived, once there is room.
  void push(const PlanBlock& block);
  /// Runs the queue empty, then stands still for `seconds`.
  void stand(double seconds);

  [[nodiscard]] bool full() const { return size_ == ring_.size(); }
  /// The time up to which everything has run; after stand() that is all.
  [[nodiscard]] double time() const { return time_; }
  /// Times that the queue ran empty between two pieces that meant to go on.
  [[nodiscard]] std::int64_t starved() const { return starved_; }

 private:
  struct Entry {
    PlanBlock block;
    double reachable_square = 0.0;  ///< Entry from which all that follows can still be stopped.
    double entry_square = 0.0;      ///< That, and reachable from what comes before.
  };
  [[nodiscard]] Entry& at(std::size_t index) { return ring_[(first_ + index) % ring_.size()]; }
  void plan();
  [[nodiscard]] double first_duration();
  void run_until(double time);
  void run_part(double seconds);
  void pop();

  std::vector<Entry> ring_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  double time_ = 0.0;         ///< When the first piece of the queue goes on from where it stands.
  double arrival_ = 0.0;      ///< When the latest line has arrived.
  bool interrupted_ = false;  ///< The queue ran empty, and not by stand().
  std::int64_t starved_ = 0;
};

}  // namespace lensforge
