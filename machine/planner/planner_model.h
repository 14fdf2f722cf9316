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

/// What decides how fast a Grbl-family controller runs a program. The defaults are Grbl's own.
struct PlannerSettings {
  Eigen::Vector3d max_rate{500.0, 500.0, 500.0};      ///< $110 … $112, mm/min
  Eigen::Vector3d acceleration{10.0, 10.0, 10.0};     ///< $120 … $122, mm/s²
  Eigen::Vector3d steps_per_mm{250.0, 250.0, 250.0};  ///< $100 … $102; 0 rounds to no steps.
  double junction_deviation = 0.01;                   ///< $11, mm
  double arc_tolerance = 0.002;                       ///< $12, mm
  int blocks = 15;                ///< Motions that the controller holds, the running one included.
  double lines_per_second = 0.0;  ///< That the path to the controller carries; 0 without limit.
  double bytes_per_second = 0.0;  ///< Likewise.
};

/// Takes $11, $12, $100 … $102, $110 … $112 and $120 … $122 from a controller's answer to `$$`.
/// @throw InputError naming a setting that is missing or not above 0.
PlannerSettings planner_settings(const std::map<int, double>& settings);

/// One straight piece as the controller plans it: mm, s.
struct PlanBlock {
  double length = 0.0;
  double acceleration = 0.0;      ///< Along it, no axis beyond its own.
  double nominal = 0.0;           ///< Speed asked for, no axis beyond its own.
  double max_entry_square = 0.0;  ///< At the corner before it, (mm/s)²; 0 after a standstill.
  std::int64_t line = 0;          ///< Of the program.
  bool begins_line = false;       ///< First piece of its line.
};

/// Turns motions into the pieces that a Grbl-family planner holds: arcs into chords within the arc
/// tolerance, lengths rounded to steps, speeds and accelerations limited per axis, and corners by
/// junction deviation.
class MotionBlocks {
 public:
  explicit MotionBlocks(const PlannerSettings& settings);

  /// Hands the pieces of `motion` to `take`; none if it is less than a step.
  void split(const GcodeMotion& motion, const std::function<void(const PlanBlock&)>& take);

  /// The next piece starts from a standstill.
  void stand_still() { moving_ = false; }

 private:
  struct Piece {
    Eigen::Vector3d end;
    double speed;  ///< Asked for, mm/s; of a rapid infinite.
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

/// Chords of an arc of `radius` and `sweep` (either sign) that stay within `tolerance` of it.
int arc_chords(double radius, double sweep, double tolerance);

/// Where a motion is after some time.
struct ProfilePoint {
  double distance = 0.0;  ///< mm from its begin.
  double speed = 0.0;     ///< mm/s
};

/// Speed over a straight piece: up at a constant acceleration, along, down. mm, s.
class SpeedProfile {
 public:
  /// @param entry,exit  speeds at its ends, mm/s; reachable from one another over `length`.
  /// @param nominal     the speed that it may not pass between them.
  SpeedProfile(double length, double entry, double exit, double nominal, double acceleration);

  /// Seconds for the whole of it.
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

/// How long a program takes, and what it asks of the path that its lines come by.
struct PlanTime {
  double seconds = 0.0;                 ///< With lines always there in time.
  double stream_limited_seconds = 0.0;  ///< With lines no faster than the settings allow.
  std::int64_t motions = 0;             ///< Lines that move.
  std::int64_t blocks = 0;              ///< Pieces planned, chords of arcs one by one.
  std::int64_t starved = 0;             ///< Times that the limited stream let the queue run empty.
  double length = 0.0;                  ///< Of the path, mm.
  /// The most that is asked over as many lines in a row as the queue holds.
  double peak_lines_per_second = 0.0;
  double peak_bytes_per_second = 0.0;
  std::int64_t peak_line = 0;  ///< The last of those lines.

  /// The stream costs more than one percent of the time.
  [[nodiscard]] bool stream_limited() const { return stream_limited_seconds > 1.01 * seconds; }
};

/// Time model of a Grbl-family controller: per-axis limits of speed and acceleration, corners by
/// junction deviation, arcs as chords, and a look-ahead of so many pieces. Constant memory. Not
/// modelled: overrides, homing, the 10 ms grid of the step generator. Within 2 % of the simulated
/// controller: PlannerAgainstSimulator.
class PlannerModel {
 public:
  explicit PlannerModel(const PlannerSettings& settings);

  /// A line was sent, with its end `bytes` long, whether or not it moves.
  void line(std::size_t bytes);
  /// A motion of the line that line() told of.
  void add(const GcodeMotion& motion);
  /// The machine stops and waits: a dwell, a spindle that changes, a tool.
  void wait(double seconds);
  /// Runs everything to its end. More may follow.
  PlanTime finish();

 private:
  void note_demand(std::int64_t line);

  PlannerSettings settings_;
  MotionBlocks pieces_;
  PlanTimeline free_;
  PlanTimeline limited_;
  PlanTime result_;
  struct Demand {
    double time = 0.0;       ///< When the queue took the line.
    std::int64_t bytes = 0;  ///< Sent until then.
  };
  std::vector<Demand> recent_;  ///< Of the last lines that moved, as a ring.
  std::size_t noted_ = 0;
  std::int64_t bytes_ = 0;
};

}  // namespace lensforge
