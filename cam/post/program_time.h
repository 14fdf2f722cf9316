// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "cam/post/program_reader.h"
#include "cam/workshop/workshop.h"
#include "machine/planner/planner_model.h"

namespace lensforge {

/// How long a stretch of a program takes, and what it asks of the controller and the link to it.
struct ProgramTime {
  double seconds = 0.0;  ///< With lines always there in time.
  /// With lines no faster than PlannerSettings::lines_per_second and bytes_per_second.
  double stream_limited_seconds = 0.0;
  std::int64_t lines = 0;    ///< That move.
  std::int64_t blocks = 0;   ///< As the planner has them, chords of arcs one by one.
  std::int64_t starved = 0;  ///< Times that the limited stream let the queue run empty.
  /// Most lines a second over as many lines as the queue holds, at the speeds that the machine
  /// reaches, and where.
  double peak_lines_per_second = 0.0;
  std::int64_t peak_line = 0;

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
  PlannerModel model_;
  double tool_change_;
  ProgramTime time_;
};

}  // namespace lensforge
