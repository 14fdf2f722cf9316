// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "design/schedule/checkpoint.h"
#include "design/schedule/design_task.h"
#include "design/schedule/guided_optimization.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

/// What a design tells while it runs: rows of convergence.csv, which its checkpoint keeps, and
/// progress.
class DesignLog {
 public:
  /// @param state  says which level and round is being done, and takes the rows. Both must outlive
  ///               the log.
  DesignLog(const DesignTask& task, Checkpoint& state)
      : task_(task), state_(state), spent_before_(state.seconds) {}

  /// Spent on the design so far, interruptions not counted.
  [[nodiscard]] double seconds() const;

  void add(const std::vector<TransportStep>& steps);
  /// For the iterations of a stage; it ends them when the control asks for a stop.
  [[nodiscard]] GuidedOptimization::Observer observer(const char* stage);

  /// Progress within a level. @param iteration  of the round.
  void report(const std::string& detail, int iteration) const;
  void report_rendering() const;  ///< The levels are done.
  void report_done() const;

  /// Of a step of this round, which is worth a remark to the user.
  void ended_early(const std::string& step, const std::string& why);
  /// The last such remark, to follow another; empty if there was none.
  [[nodiscard]] const std::string& remark() const { return remark_; }

 private:
  [[nodiscard]] ConvergenceRow new_row(const char* stage, int iteration) const;

  const DesignTask& task_;
  Checkpoint& state_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double spent_before_;
  std::string remark_;
};

}  // namespace lensforge
