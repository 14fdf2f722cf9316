// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "design/optics/made_by.h"

namespace lensforge {

/// Nodes along one direction of a spline as sums of its coefficients, and what is added to their
/// heights.
struct AxisBasis {
  int coefficients = 0;
  int taps = 0;                    ///< Coefficients that a node is a sum of.
  std::vector<int> first;          ///< Of a node: the first of its coefficients; never falls.
  std::vector<double> value;       ///< Of heights; taps × nodes.
  std::vector<double> slope;       ///< taps × nodes, derivatives by the knot cell.
  std::vector<double> plan_value;  ///< Of x and y, those of the spline itself; taps × nodes.
  std::vector<double> plan_slope;  ///< taps × nodes, derivatives by the knot cell.
  std::vector<double> lift;        ///< Added to a node's height, mm.
  std::vector<double> tilt;        ///< Its derivative, mm by the knot cell.

  [[nodiscard]] int nodes() const { return static_cast<int>(first.size()); }
};

/// Points k / samples of 0 … cells, in knot cells.
std::vector<double> even_points(int cells, int samples);

/// The spline itself: cubic B-splines with a knot at every whole number, fourfold at both ends.
/// @param points  of the nodes, ascending, in knot cells.
AxisBasis plain_basis(int cells, const std::vector<double>& points);

/// An even spline's direction in space.
struct AxisLength {
  int axis = 0;         ///< 0: x; 1: y.
  int cells = 1;        ///< Knot cells, ≥ 1.
  double length = 1.0;  ///< mm
};

/// An even spline as it comes off the machine (MadeSurface): f replaced by G_σ ∗ (f + p²/24 · f″),
/// less what polish takes off at the rim. Both are linear in the coefficients, so that the made
/// surface is a sum of the same coefficients by other functions. Of a spline whose knots are not
/// even it is about what is made.
/// @param points  as for plain_basis(). @pre made.polish_sigma > 0.
AxisBasis made_basis(const AxisLength& along, const std::vector<double>& points,
                     const MadeBy& made);

}  // namespace lensforge
