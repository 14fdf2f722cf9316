// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "machine/gcode/gcode_motion.h"

namespace lensforge {

/// Settings that determine how fast a Grbl-family controller runs a program. The defaults are
/// Grbl's own.
struct PlannerSettings {
  Eigen::Vector3d max_rate{500.0, 500.0, 500.0};      ///< $110 … $112, mm/min
  Eigen::Vector3d acceleration{10.0, 10.0, 10.0};     ///< $120 … $122, mm/s²
  Eigen::Vector3d steps_per_mm{250.0, 250.0, 250.0};  ///< $100 … $102; 0: no rounding to steps.
  double junction_deviation = 0.01;                   ///< $11, mm
  double arc_tolerance = 0.002;                       ///< $12, mm
  int blocks = 15;                ///< Motions in the controller, including the running one.
  double lines_per_second = 0.0;  ///< Limit of the connection; 0 for none.
  double bytes_per_second = 0.0;  ///< Limit of the connection; 0 for none.
};

/// Takes $11, $12, $100 … $102, $110 … $112 and $120 … $122 from a controller's answer to `$$`.
/// @throw InputError naming a setting that is missing or not above 0.
PlannerSettings planner_settings(const std::map<int, double>& settings);

/// One straight piece in the controller's planner: mm, s.
struct PlanBlock {
  double length = 0.0;
  double acceleration = 0.0;      ///< Along the piece, within every axis's limit.
  double nominal = 0.0;           ///< Requested speed, within every axis's limit.
  double max_entry_square = 0.0;  ///< At the preceding corner, (mm/s)²; 0 after a standstill.
  std::int64_t line = 0;          ///< Line of the program.
  bool begins_line = false;       ///< First piece of its line.
};

/// Splits motions into the pieces of a Grbl-family planner: arcs into chords within the arc
/// tolerance, lengths rounded to steps, speeds and accelerations limited per axis, and corners by
/// junction deviation.
class MotionBlocks {
 public:
  explicit MotionBlocks(const PlannerSettings& settings);

  /// Passes the pieces of `motion` to `take`; none if it is shorter than a step.
  void split(const GcodeMotion& motion, const std::function<void(const PlanBlock&)>& take);

  /// The next piece starts from a standstill.
  void stand_still() { moving_ = false; }

 private:
  struct Piece {
    Eigen::Vector3d end;
    double speed;  ///< Requested, mm/s; infinite for a rapid.
  };
  bool make_block(const Piece& piece, PlanBlock& block);
  [[nodiscard]] double max_entry_square(const Eigen::Vector3d& unit, double nominal) const;
  [[nodiscard]] Eigen::Vector3d on_steps(const Eigen::Vector3d& point) const;

  PlannerSettings settings_;
  Eigen::Vector3d rate_;  ///< mm/s
  bool placed_ = false;
  bool moving_ = false;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d previous_unit_ = Eigen::Vector3d::Zero();
  double previous_nominal_ = 0.0;
};

/// Number of chords for an arc of `radius` and `sweep` (either sign) that stay within `tolerance`
/// of it.
int arc_chords(double radius, double sweep, double tolerance);

/// State of a motion at a given time.
struct ProfilePoint {
  double distance = 0.0;  ///< mm from its start.
  double speed = 0.0;     ///< mm/s
};

/// Speed over a straight piece: constant acceleration, constant speed, constant deceleration. mm,
/// s.
class SpeedProfile {
 public:
  /// @param entry,exit  speeds at its ends, mm/s; reachable from one another over `length`.
  /// @param nominal     maximum speed between them.
  SpeedProfile(double length, double entry, double exit, double nominal, double acceleration);

  /// Total time, s.
  [[nodiscard]] double duration() const { return up_ + along_ + down_; }
  /// @pre 0 ≤ time ≤ duration()
  [[nodiscard]] ProfilePoint at(double time) const;

 private:
  double length_;
  double entry_;
  double exit_;
  double acceleration_;
  double peak_;
  double up_;
  double along_;
  double down_;
};

/// Simulates a controller's motion queue over time: pieces arrive, are planned as far as they are
/// known (the last one ends at a standstill), and run. Memory for `blocks` pieces.
class PlanTimeline {
 public:
  /// @param blocks  capacity of the queue, including the running piece; at least 2.
  explicit PlanTimeline(int blocks);

  /// A line takes `seconds` to arrive; its pieces are queued after that.
  void line(double seconds) { arrival_ += seconds; }
  /// Queues a piece once it has arrived and there is room.
  void push(const PlanBlock& block);
  /// Runs the queue until it is empty, then waits for `seconds`.
  void stand(double seconds);

  [[nodiscard]] bool full() const { return size_ == ring_.size(); }
  /// The time up to which pieces have run; after stand() all have.
  [[nodiscard]] double time() const { return time_; }
  /// Number of times the queue ran empty between two pieces that should join without a stop.
  [[nodiscard]] std::int64_t starved() const { return starved_; }

 private:
  struct Entry {
    PlanBlock block;
    double reachable_square = 0.0;  ///< Maximum entry speed from which later pieces can still stop.
    double entry_square = 0.0;      ///< Also reachable from the pieces before.
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
  double time_ = 0.0;         ///< Time at which the first queued piece starts.
  double arrival_ = 0.0;      ///< Time at which the latest line has arrived.
  bool interrupted_ = false;  ///< The queue ran empty, not because of stand().
  std::int64_t starved_ = 0;
};

/// Run time of a program and the transfer rate that it needs.
struct PlanTime {
  double seconds = 0.0;                 ///< If every line arrives in time.
  double stream_limited_seconds = 0.0;  ///< With the transfer rates of the settings.
  std::int64_t motions = 0;             ///< Number of motions.
  std::int64_t blocks = 0;              ///< Planned pieces; each chord of an arc counts.
  std::int64_t starved = 0;  ///< Number of times the limited stream let the queue run empty.
  double length = 0.0;       ///< Length of the path, mm.
  /// Maximum rates needed, over as many consecutive lines as the queue holds.
  double peak_lines_per_second = 0.0;
  double peak_bytes_per_second = 0.0;
  std::int64_t peak_line = 0;  ///< The last of those lines.

  /// True if the stream adds more than 1 % to the time.
  [[nodiscard]] bool stream_limited() const { return stream_limited_seconds > 1.01 * seconds; }
};

/// Time model of a Grbl-family controller: per-axis limits of speed and acceleration, corners by
/// junction deviation, arcs as chords, and a limited look-ahead. Constant memory. Not modelled:
/// overrides, homing, the 10 ms grid of the step generator. Agrees with the simulated controller
/// within 2 % (PlannerAgainstSimulator).
class PlannerModel {
 public:
  explicit PlannerModel(const PlannerSettings& settings);

  /// A line of `bytes` bytes, including its end, was sent, with or without a motion.
  void line(std::size_t bytes);
  /// A motion of the line of the last line() call.
  void add(const GcodeMotion& motion);
  /// The machine stops and waits: a dwell, a spindle or tool change.
  void wait(double seconds);
  /// Runs everything to its end. More lines may follow.
  PlanTime finish();

 private:
  void note_demand(std::int64_t line);

  PlannerSettings settings_;
  MotionBlocks pieces_;
  PlanTimeline free_;
  PlanTimeline limited_;
  PlanTime result_;
  struct Demand {
    double time = 0.0;       ///< Time at which the queue took the line.
    std::int64_t bytes = 0;  ///< Bytes sent until then.
  };
  std::vector<Demand> recent_;  ///< Latest lines with motions, a ring buffer.
  std::size_t noted_ = 0;
  std::int64_t bytes_ = 0;
};

}  // namespace lensforge
