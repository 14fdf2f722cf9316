// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "cam/report/report_data.h"

namespace lensforge {

/// One step of a recipe.
struct PolishStep {
  std::string grit;
  double minutes = 0.0;
  int strokes = 0;
};

/// Examples of steps with a pad, to start from on a coupon; none for a film (order 4), which takes
/// no grit. Minutes grow with the area.
std::vector<PolishStep> example_steps(const PolishTask& task);

/// What the forecast expects of polishing: what stays of the rows and of which ripple 1/e.
std::string expected_polish(const PolishTask& task);

/// How to get from the examples to the workshop's own recipe.
std::string polish_advice(const PolishTask& task);

}  // namespace lensforge
