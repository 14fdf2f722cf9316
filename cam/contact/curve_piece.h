// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace lensforge {

/// A straight line parallel to x or to y, seen from above.
struct AxisLine {
  int along = 0;        ///< 0: parallel to x, 1: parallel to y.
  double across = 0.0;  ///< The other coordinate, mm.

  [[nodiscard]] Eigen::Vector2d at(double u) const {
    return along == 0 ? Eigen::Vector2d(u, across) : Eigen::Vector2d(across, u);
  }
};

/// A piece of a curve in the vertical plane over an AxisLine, u → height:
///     z(u) = height + rise·t + bow·√(ρ² − (offset + rate·t)²),  t = u − u₀,
/// a straight line (bow 0), an arc of a circle or of an ellipse. What one facet, edge or vertex
/// makes of a ball's tip has this form with bow ≥ 0, and so has a circular move of the tool with
/// bow ±1.
struct CurvePiece {
  double begin = 0.0, end = 0.0;  ///< Where it holds, mm.
  double u0 = 0.0;                ///< mm
  double height = 0.0;            ///< mm
  double rise = 0.0;
  double bow = 0.0;
  double rho2 = 0.0;          ///< mm²
  double offset = 0.0;        ///< mm
  double rate = 0.0;          ///< −1 … 1
  std::int64_t feature = -1;  ///< 8 · triangle + 0 for its facet, 1 + k edge k, 4 + k corner k.

  [[nodiscard]] bool straight() const { return bow == 0.0; }
  /// Bends down everywhere, or is straight.
  [[nodiscard]] bool concave() const { return bow >= 0.0; }

  [[nodiscard]] double value(double u) const {
    const double t = u - u0;
    const double linear = height + rise * t;
    if (straight()) return linear;
    const double d = offset + rate * t;
    return linear + bow * std::sqrt(std::max(rho2 - d * d, 0.0));
  }
  [[nodiscard]] double slope(double u) const {
    if (straight()) return rise;
    const double d = offset + rate * (u - u0);
    return rise - bow * rate * d / std::sqrt(std::max(rho2 - d * d, kSteepest * rho2));
  }
  /// Arcs end where they are 1 : 30,000 from vertical: what holds a ball there is a wall.
  static constexpr double kSteepest = 1e-9;
};

/// How far a piece can be off its chord between two places of known height, mm: its end tangents
/// meet no farther away, because it bends one way only. Falls by the square of the distance of the
/// places.
inline double bulge(const CurvePiece& piece, double from, double at_from, double to, double at_to) {
  if (piece.straight()) return 0.0;
  const double chord = (at_to - at_from) / (to - from);
  const double left = std::abs(piece.slope(from) - chord);
  const double right = std::abs(piece.slope(to) - chord);
  return left + right > 0.0 ? (to - from) * left * right / (left + right) : 0.0;
}
inline double bulge(const CurvePiece& piece, double from, double to) {
  return bulge(piece, from, piece.value(from), to, piece.value(to));
}

/// Largest and smallest value of a difference.
struct Range {
  double low = 0.0;
  double high = 0.0;
};

/// Bounds of a − b between two places where both hold.
inline Range difference_bounds(const CurvePiece& a, const CurvePiece& b, double from, double to) {
  const double a_from = a.value(from);
  const double a_to = a.value(to);
  const double b_from = b.value(from);
  const double b_to = b.value(to);
  const double bulge_a = bulge(a, from, a_from, to, a_to);
  const double bulge_b = bulge(b, from, b_from, to, b_to);
  Range range{std::min(a_from - b_from, a_to - b_to), std::max(a_from - b_from, a_to - b_to)};
  range.high += (a.concave() ? bulge_a : 0.0) + (b.concave() ? 0.0 : bulge_b);
  range.low -= (a.concave() ? 0.0 : bulge_a) + (b.concave() ? bulge_b : 0.0);
  return range;
}

}  // namespace lensforge
