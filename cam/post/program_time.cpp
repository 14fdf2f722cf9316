// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_time.h"

#include <algorithm>

namespace lensforge {

double ProgramTime::starved_share() const {
  if (!(stream_limited_seconds > 0.0)) return 0.0;
  return std::max(0.0, 1.0 - seconds / stream_limited_seconds);
}

ProgramTime& ProgramTime::operator+=(const ProgramTime& other) {
  seconds += other.seconds;
  waiting_seconds += other.waiting_seconds;
  stream_limited_seconds += other.stream_limited_seconds;
  lines += other.lines;
  blocks += other.blocks;
  starved += other.starved;
  cutting_length += other.cutting_length;
  rapid_length += other.rapid_length;
  if (other.peak_lines_per_second > peak_lines_per_second) {
    peak_lines_per_second = other.peak_lines_per_second;
    peak_line = other.peak_line;
  }
  programmed_lines_per_second =
      std::max(programmed_lines_per_second, other.programmed_lines_per_second);
  feed_seconds += other.feed_seconds;
  feed_lines += other.feed_lines;
  mean_programmed_lines_per_second =
      feed_seconds > 0.0 ? static_cast<double>(feed_lines) / feed_seconds : 0.0;
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
    : model_(settings),
      tool_change_(tool_change),
      recent_(static_cast<std::size_t>(std::max(settings.blocks, 2)), 0.0) {}

void ProgramTimer::take(const ProgramLine& line) {
  if (line.bytes > 0) model_.line(line.bytes);
  double waits = line.effect.dwell;
  if (line.effect.tool_change) waits += tool_change_;
  if (waits > 0.0 || line.effect.spindle_changed) model_.wait(waits);
  time_.waiting_seconds += waits;
  for (const GcodeMotion& motion : line.effect.motions()) {
    model_.add(motion);
    if (motion.rapid) {
      time_.rapid_length += motion.length();
    } else {
      take_rate(motion);
    }
  }
}

/// Lines over the time that they last, over as many lines as the queue holds.
void ProgramTimer::take_rate(const GcodeMotion& motion) {
  const double length = motion.length();
  const double seconds = 60.0 * length / motion.feed;
  time_.cutting_length += length;
  time_.feed_seconds += seconds;
  const auto size = static_cast<std::int64_t>(recent_.size());
  double& oldest = recent_[static_cast<std::size_t>(time_.feed_lines % size)];
  recent_sum_ += seconds - oldest;
  oldest = seconds;
  ++time_.feed_lines;
  if (time_.feed_lines < size || !(recent_sum_ > 0.0)) return;
  time_.programmed_lines_per_second =
      std::max(time_.programmed_lines_per_second, static_cast<double>(size) / recent_sum_);
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
  ProgramTime total;
  total += time_;
  return total;
}

}  // namespace lensforge
