// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "machine/gcode/gcode_motion.h"
#include "machine/planner/motion_blocks.h"
#include "machine/planner/plan_timeline.h"
#include "machine/planner/planner_settings.h"

namespace lensforge {

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
