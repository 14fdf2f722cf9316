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
  std::vector<Eigen::Vector2d> points;  ///< Time in s, ascending, and value.
};

/// SVG plot of decreasing values over time, on a logarithmic scale of whole decades. Empty for
/// fewer than two points in all.
/// @param label  text alternative.
std::string decade_plot(const std::vector<PlotCurve>& curves, std::string_view label);

}  // namespace lensforge
