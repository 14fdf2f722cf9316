// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// One line of a plot.
struct PlotCurve {
  std::string name;
  std::vector<Eigen::Vector2d> points;  ///< Seconds, ascending, and the value then.
};

/// What falls over time, on a logarithmic scale of whole decades. SVG; empty for fewer than two
/// points in all.
/// @param label  what it shows, for those who cannot see it (text).
std::string decade_plot(const std::vector<PlotCurve>& curves, std::string_view label);

}  // namespace lensforge
