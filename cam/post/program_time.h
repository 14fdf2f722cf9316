// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "cam/post/program_reader.h"
#include "cam/tool/workshop.h"
#include "machine/planner/planner_model.h"

namespace lensforge {

/// How long a stretch of a program takes, and what it asks of the controller and the link to it.
struct ProgramTime {
  double seconds = 0.0;          ///< With lines always there in time.
  double waiting_seconds = 0.0;  ///< Of these, dwells and tool changes.
  /// With lines no faster than PlannerSettings::lines_per_second and bytes_per_second.
  double stream_limited_seconds = 0.0;
  std::int64_t lines = 0;       ///< That move.
  std::int64_t blocks = 0;      ///< As the planner has them, chords of arcs one by one.
  std::int64_t starved = 0;     ///< Times that the limited stream let the queue run empty.
  double cutting_length = 0.0;  ///< Of motions at feed, mm.
  double rapid_length = 0.0;
  /// Most lines a second over as many lines as the queue holds, at the speeds that the machine
  /// reaches, and where.
  double peak_lines_per_second = 0.0;
  std::int64_t peak_line = 0;
  /// The same if the programmed feed were reached everywhere.
  double programmed_lines_per_second = 0.0;
  /// The mean over all motions at feed, if the programmed feed were reached.
  double mean_programmed_lines_per_second = 0.0;
  double feed_seconds = 0.0;    ///< Length ÷ feed of the motions at feed; no promise.
  std::int64_t feed_lines = 0;  ///< Motions at feed.

  /// The share of the time that a too slow link adds, 0 … 1.
  [[nodiscard]] double starved_share() const;
  /// The sum of two stretches: of rates the larger.
  ProgramTime& operator+=(const ProgramTime& other);
};

/// The planner's settings for a machine of the workshop.
PlannerSettings planner_settings(const Machine& machine);

/// Times a program line by line with the model of machine/planner: axis-limited speeds and
/// accelerations, junction deviation, a finite look-ahead; not length ÷ feed. Constant memory.
class ProgramTimer {
 public:
  /// @param tool_change  seconds for M6.
  ProgramTimer(const PlannerSettings& settings, double tool_change);

  void take(const ProgramLine& line);
  /// All up to here, the machine standing still. Nothing may follow.
  [[nodiscard]] ProgramTime finish();

 private:
  void take_rate(const GcodeMotion& motion);

  PlannerModel model_;
  double tool_change_;
  ProgramTime time_;
  std::vector<double> recent_;  ///< Seconds at the programmed feed of the last lines, a ring.
  double recent_sum_ = 0.0;
};

}  // namespace lensforge
