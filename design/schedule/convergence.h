// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "design/energy/objective_options.h"

namespace lensforge {

/// One iteration, a row of convergence.csv.
struct ConvergenceRow {
  /// "transport": a Newton step; "update": a step of the correspondence-guided update; "render": a
  /// step of rendering-guided optimisation; "spline": a step of a spline's optimisation.
  std::string stage;
  int level = 0;
  int round = 0;
  int iteration = 0;
  EnergyValues energy;      ///< Unweighted terms and their weighted total.
  double mass_error = 0.0;  ///< For a Newton step: max |mass − wanted| / wanted.
  /// Display-encoded, at the level's resolution; 0 if no picture is rendered.
  double mae = 0.0;
  double seconds = 0.0;  ///< Since the start of the design, without interruptions.
};

/// The text of convergence.csv: a header and one line per row.
std::string convergence_csv(const std::vector<ConvergenceRow>& rows);

}  // namespace lensforge
