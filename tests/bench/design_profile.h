// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "core/page/drawings.h"

/// Time of a design by stage, from its convergence.csv.
namespace lensforge::bench {

/// One kind of step.
struct DesignPhase {
  std::string stage;     ///< As in convergence.csv: "transport", "render", …
  int steps = 0;         ///< Rows of it.
  double seconds = 0.0;  ///< From the row before each to it: what precedes a stage's first step
                         ///< counts as that stage's.
};

struct DesignProfile {
  std::vector<DesignPhase> phases;  ///< In the order in which they began.
  double seconds = 0.0;             ///< Until the last row.
  /// Seconds and the least MAE until then, of the steps that have a picture.
  std::vector<Eigen::Vector2d> errors;
};

/// @param csv   text of convergence.csv.
/// @param pace  processor seconds per second of the table, which are of wall clock.
/// @throw InputError if it has no columns stage, mae and seconds, or a number is missing.
DesignProfile design_profile(const std::string& csv, double pace);

/// The MAE that a profile had reached after so many seconds; NaN before the first picture.
double error_after(const DesignProfile& profile, double seconds);

}  // namespace lensforge::bench
