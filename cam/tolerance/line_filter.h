// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

namespace lensforge {

/// Weights of pairs of nodes around a place on a line: pair k is the nodes k before node n and k
/// behind node n + shift, of which averages take the sum and slopes the difference. With shift 0
/// the place is node n itself, with 1 the middle between it and the next.
struct LineFilter {
  std::int64_t shift = 0;
  std::vector<double> average;
  std::vector<double> slope;  ///< 1/mm

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
/// response. Straight lines stay as they are. LineFilter.* in its test have the error: 0.2 % for
/// waves of five nodes and more.
/// @param shift  0 or 1. @pre reach ≥ 2, and ≥ 4.2 σ / spacing for that error.
LineFilter line_filter(const LinePolish& polish, std::int64_t shift, std::int64_t reach);

/// The reach that line_filter() needs.
std::int64_t line_filter_reach(double sigma, double spacing);

}  // namespace lensforge
