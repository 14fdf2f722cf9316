// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

namespace lensforge {

struct LbfgsOptions {
  int max_iterations = 100;
  int history = 8;  ///< Pairs of steps and gradient changes that are kept, ≥ 1.
  /// Ends when the value fell by less than this share of itself over `stall_window` iterations.
  double relative_decrease = 1e-4;
  int stall_window = 10;
  /// Sufficient decrease and curvature of the weak Wolfe conditions (Nocedal & Wright, 3.6).
  double armijo = 1e-4;
  double wolfe = 0.9;
  int max_evaluations_per_step = 20;
};

struct LbfgsSummary {
  enum class Status { kConverged, kIterationLimit, kStopped, kNoDescent, kInfeasibleStart };
  Status status = Status::kIterationLimit;
  std::string message;  ///< Why it ended, in one line.
  double initial_value = 0.0;
  double value = 0.0;
  int iterations = 0;
  int evaluations = 0;

  [[nodiscard]] bool converged() const { return status == Status::kConverged; }
};

/// Asked after every accepted step with the step's number; returning false ends the minimisation.
using LbfgsObserver = std::function<bool(int iteration, double value)>;

}  // namespace lensforge
