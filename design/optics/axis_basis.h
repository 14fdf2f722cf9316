// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "design/optics/made_by.h"

namespace lensforge {

/// Nodes along one direction of a spline as sums of its coefficients, and what is added to their
/// heights.
struct AxisBasis {
  int coefficients = 0;
  int taps = 0;               ///< Coefficients that a node is a sum of.
  std::vector<int> first;     ///< Of a node: the first of its coefficients; never falls.
  std::vector<double> value;  ///< taps × nodes
  std::vector<double> slope;  ///< taps × nodes, derivatives by the knot cell.
  std::vector<double> lift;   ///< Added to a node's height, mm.
  std::vector<double> tilt;   ///< Its derivative, mm by the knot cell.

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

/// The spline as it comes off the machine: f replaced by G_σ ∗ (f + p²/24 · f″), less what polish
/// takes off at the rim. Both are linear in the coefficients, so that the made surface is a sum of
/// the same coefficients by other functions.
///
/// Polish is the average with a Gaussian; beyond the ends f goes on turned about its end, as
/// PolishedField has it. A ball of radius R whose axis runs over y touches f at y + R f′, so that
/// contacts are p (1 + R f″) apart. At the distance d of one it leaves (1/R − f″) d²/2 more than f,
/// on average (1/R − f″) (1 + R f″)² p²/24 = p²/24R + f″ p²/24 + …, of which the first part is the
/// same everywhere. What the average leaves out are waves of the pitch, of which polishing leaves
/// exp(−2π²σ²/p²). Along the rows there is no such term. Valleys sharper than the ball, which it
/// would fill, are for ball_term() to prevent.
/// @param points  as for plain_basis(). @pre made.polish_sigma > 0.
AxisBasis made_basis(const AxisLength& along, const std::vector<double>& points,
                     const MadeBy& made);

}  // namespace lensforge
