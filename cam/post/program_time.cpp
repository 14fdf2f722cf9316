// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_time.h"

namespace lensforge {

ProgramTime& ProgramTime::operator+=(const ProgramTime& other) {
  seconds += other.seconds;
  stream_limited_seconds += other.stream_limited_seconds;
  lines += other.lines;
  blocks += other.blocks;
  starved += other.starved;
  if (other.peak_lines_per_second > peak_lines_per_second) {
    peak_lines_per_second = other.peak_lines_per_second;
    peak_line = other.peak_line;
  }
  return *this;
}

PlannerSettings planner_settings(const Machine& machine) {
  PlannerSettings settings;
  settings.max_rate = machine.max_rate;
  settings.acceleration = machine.acceleration;
  settings.steps_per_mm = machine.steps_per_mm;
  settings.junction_deviation = machine.junction_deviation;
  settings.arc_tolerance = machine.arc_tolerance;
  settings.blocks = machine.look_ahead;
  settings.lines_per_second = machine.lines_per_second;
  return settings;
}

ProgramTimer::ProgramTimer(const PlannerSettings& settings, double tool_change)
    : model_(settings), tool_change_(tool_change) {}

void ProgramTimer::take(const ProgramLine& line) {
  if (line.bytes > 0) model_.line(line.bytes);
  double waits = line.effect.dwell;
  if (line.effect.tool_change) waits += tool_change_;
  if (waits > 0.0 || line.effect.spindle_changed) model_.wait(waits);
  for (const GcodeMotion& motion : line.effect.motions()) model_.add(motion);
}

ProgramTime ProgramTimer::finish() {
  const PlanTime plan = model_.finish();
  time_.seconds = plan.seconds;
  time_.stream_limited_seconds = plan.stream_limited_seconds;
  time_.lines = plan.motions;
  time_.blocks = plan.blocks;
  time_.starved = plan.starved;
  time_.peak_lines_per_second = plan.peak_lines_per_second;
  time_.peak_line = plan.peak_line;
  return time_;
}

}  // namespace lensforge
