// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/planner/planner_model.h"

#include <algorithm>

namespace lensforge {
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

/// A full queue takes a line when a piece has run, so lines are taken as fast as they are needed;
/// what fills it from empty can wait.
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
