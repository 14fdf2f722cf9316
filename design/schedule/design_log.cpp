// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/design_log.h"

#include <cstddef>
#include <cstdio>

#include "core/spline/control_net.h"

namespace lensforge {
namespace {

/// Iterations weighted by their rays.
double level_work(const DesignTask& task, std::size_t level) {
  const Level& at = task.levels[level];
  const double vertices = double{1} * at.grid.columns * at.grid.rows;
  const double rays = at.spline ? kMeshSamples * kMeshSamples * vertices : vertices;
  return double{1} * at.rounds * at.iterations * rays;
}

/// Of all levels before this one.
double work_before(const DesignTask& task, std::size_t level) {
  double sum = 0.0;
  for (std::size_t l = 0; l < level; ++l) sum += level_work(task, l);
  return sum;
}

double work_total(const DesignTask& task) { return work_before(task, task.levels.size()); }

}  // namespace

double DesignLog::seconds() const {
  const auto since = std::chrono::steady_clock::now() - start_;
  return spent_before_ + std::chrono::duration<double>(since).count();
}

ConvergenceRow DesignLog::new_row(const char* stage, int iteration) const {
  ConvergenceRow row;
  row.stage = stage;
  row.level = state_.level;
  row.round = state_.round;
  row.iteration = iteration;
  row.seconds = seconds();
  return row;
}

void DesignLog::add(const std::vector<TransportStep>& steps) {
  int number = 0;
  for (const TransportStep& step : steps) {
    ConvergenceRow row = new_row("transport", ++number);
    row.mass_error = step.mass_error;
    state_.convergence.push_back(row);
  }
}

GuidedOptimization::Observer DesignLog::observer(const char* stage) {
  return [this, stage](int iteration, const DesignObjective::Evaluation& e) {
    ConvergenceRow row = new_row(stage, iteration);
    row.energy = e.energy;
    row.mae = e.mae;
    state_.convergence.push_back(row);
    char detail[64];
    std::snprintf(detail, sizeof(detail), "MAE %.4f", e.mae);
    report(detail, iteration);
    return !task_.control.stop_requested();
  };
}

void DesignLog::report(const std::string& detail, int iteration) const {
  const std::string stage = "design, level " + std::to_string(state_.level + 1) + " of " +
                            std::to_string(task_.levels.size());
  const auto level = static_cast<std::size_t>(state_.level);
  const Level& at = task_.levels[level];
  const double rounds = state_.round + static_cast<double>(iteration) / at.iterations;
  const double done = work_before(task_, level) + level_work(task_, level) * rounds / at.rounds;
  task_.control.report({stage, done, work_total(task_), detail});
}

void DesignLog::ended_early(const std::string& step, const std::string& why) {
  remark_ =
      "; " + step + " of round " + std::to_string(state_.round + 1) + " ended early (" + why + ")";
}

void DesignLog::report_rendering() const {
  task_.control.report({"design", work_total(task_), work_total(task_), "rendering the lens"});
}

void DesignLog::report_done() const {
  task_.control.report({"design", work_total(task_), work_total(task_), "done"});
}

}  // namespace lensforge
