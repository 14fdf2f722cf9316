// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <map>

namespace lensforge {

/// What decides how fast a Grbl-family controller runs a program. The defaults are Grbl's own.
struct PlannerSettings {
  Eigen::Vector3d max_rate{500.0, 500.0, 500.0};      ///< $110 … $112, mm/min
  Eigen::Vector3d acceleration{10.0, 10.0, 10.0};     ///< $120 … $122, mm/s²
  Eigen::Vector3d steps_per_mm{250.0, 250.0, 250.0};  ///< $100 … $102; 0 rounds to no steps.
  double junction_deviation = 0.01;                   ///< $11, mm
  double arc_tolerance = 0.002;                       ///< $12, mm
  int blocks = 15;                ///< Motions that the controller holds, the running one included.
  double lines_per_second = 0.0;  ///< That the path to the controller carries; 0 without limit.
  double bytes_per_second = 0.0;  ///< Likewise.
};

/// Takes $11, $12, $100 … $102, $110 … $112 and $120 … $122 from a controller's answer to `$$`.
/// @throw InputError naming a setting that is missing or not above 0.
PlannerSettings planner_settings(const std::map<int, double>& settings);

}  // namespace lensforge
