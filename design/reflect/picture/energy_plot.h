// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace lensforge::reflect {

struct ReflectUpdate;

/// One line of the plot.
struct EnergyCurve {
  std::string name;
  std::vector<Eigen::Vector2d> points;  ///< Seconds, ascending, and the energy then.
};

/// The energy of every update over the time in which it was reached, a curve for each stage.
std::vector<EnergyCurve> stage_curves(const std::vector<ReflectUpdate>& updates);

/// Energies on a logarithmic scale of whole decades. SVG; empty for fewer than two points.
std::string energy_plot(const std::vector<EnergyCurve>& curves);

}  // namespace lensforge::reflect
