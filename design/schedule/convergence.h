// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "design/energy/objective_options.h"

namespace lensforge {

/// One iteration, a row of convergence.csv.
struct ConvergenceRow {
  /// "transport" for a Newton step, "update" for a step of the correspondence-guided update,
  /// "render" for one of rendering-guided optimisation, "spline" for one of a spline's.
  std::string stage;
  int level = 0;
  int round = 0;
  int iteration = 0;
  EnergyValues energy;      ///< Unweighted terms and their weighted total.
  double mass_error = 0.0;  ///< Of a Newton step: max |mass − wanted| / wanted over the cells.
  /// Display-encoded, at the level's resolution; 0 where no picture is rendered.
  double mae = 0.0;
  double seconds = 0.0;  ///< Since the start of the design, interruptions not counted.
};

/// The text of convergence.csv: a header and one line per row.
std::string convergence_csv(const std::vector<ConvergenceRow>& rows);

}  // namespace lensforge
