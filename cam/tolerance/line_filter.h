// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

namespace lensforge {

/// Weights of the nodes 0, 1, … away along a line: of the sum of both sides for averages and of
/// their difference for slopes.
struct LineFilter {
  std::vector<double> average;
  std::vector<double> slope;  ///< 1/mm; the first is 0.

  [[nodiscard]] std::int64_t reach() const { return static_cast<std::int64_t>(average.size()) - 1; }
};

/// What a polish still has to do to heights that are means over boxes of nodes around them.
struct LinePolish {
  double sigma = 0.0;        ///< Of the Gaussian, mm, ≥ 0.
  double spacing = 0.0;      ///< Of the nodes, mm, > 0.
  double box = 0.0;          ///< Width of the boxes, mm, 0 … 2 spacings.
  std::int64_t samples = 1;  ///< That each box is the mean of, evenly spaced.
};

/// The filter that turns means over boxes into the polished heights and their slopes: of all with
/// `reach` nodes to either side the one that comes nearest to exp(−σ²k²/2) / B(k) over the
/// frequencies that the nodes can carry, in the least squares, where B(k) is the box's own
/// response. Straight lines stay as they are. LineFilter.* in its test have the error: 0.1 % for
/// waves of five nodes and more.
/// @pre reach ≥ 2, and ≥ 4.2 σ / spacing for that error.
LineFilter line_filter(const LinePolish& polish, std::int64_t reach);

/// The reach that line_filter() needs.
std::int64_t line_filter_reach(double sigma, double spacing);

}  // namespace lensforge
