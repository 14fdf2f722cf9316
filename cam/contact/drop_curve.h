// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cam/contact/drop_cutter.h"

namespace lensforge {

/// A straight line parallel to x or to y, seen from above.
struct AxisLine {
  int along = 0;        ///< 0: parallel to x, 1: parallel to y.
  double across = 0.0;  ///< The other coordinate, mm.

  [[nodiscard]] Eigen::Vector2d at(double u) const {
    return along == 0 ? Eigen::Vector2d(u, across) : Eigen::Vector2d(across, u);
  }
};

/// A curve's height (mm) and slope at a place of an AxisLine.
struct CurveTangent {
  double u = 0.0;
  double height = 0.0;
  double slope = 0.0;

  [[nodiscard]] double at(double place) const { return height + slope * (place - u); }
};

/// A piece of a curve in the vertical plane over an AxisLine, u → height:
///     z(u) = height + rise·t + bow·√(ρ² − (offset + rate·t)²),  t = u − u₀,
/// a straight line (bow 0), an arc of a circle or of an ellipse. The tip height of a ball on one
/// facet, edge or vertex has this form with bow ≥ 0, and a circular move of the tool with bow ±1.
struct CurvePiece {
  double begin = 0.0, end = 0.0;  ///< Its interval, mm.
  double u0 = 0.0;                ///< mm
  double height = 0.0;            ///< mm
  double rise = 0.0;
  double bow = 0.0;
  double rho2 = 0.0;          ///< mm²
  double offset = 0.0;        ///< mm
  double rate = 0.0;          ///< −1 … 1
  std::int64_t feature = -1;  ///< 8 · triangle + 0 for its facet, 1 + k edge k, 4 + k corner k.

  [[nodiscard]] bool straight() const { return bow == 0.0; }
  /// True if it bends down everywhere, or is straight.
  [[nodiscard]] bool concave() const { return bow >= 0.0; }

  [[nodiscard]] double value(double u) const {
    const double t = u - u0;
    const double linear = height + rise * t;
    if (straight()) return linear;
    const double d = offset + rate * t;
    return linear + bow * std::sqrt(std::max(rho2 - d * d, 0.0));
  }
  [[nodiscard]] double slope(double u) const { return tangent(u).slope; }
  /// Height and slope together.
  [[nodiscard]] CurveTangent tangent(double u) const {
    const double t = u - u0;
    const double linear = height + rise * t;
    if (straight()) return {u, linear, rise};
    const double d = offset + rate * t;
    const double below2 = rho2 - d * d;
    const double root = std::sqrt(std::max(below2, kSteepest * rho2));
    const double up = below2 >= kSteepest * rho2 ? root : std::sqrt(std::max(below2, 0.0));
    return {u, linear + bow * up, rise - bow * rate * d / root};
  }
  /// Arcs end where they are 1 : 30,000 from vertical: there a wall holds the ball.
  static constexpr double kSteepest = 1e-9;
};

/// Maximum distance of a piece from its chord between two places, mm: the tangents at its ends meet
/// no farther away, because it bends one way only. Proportional to the square of the chord's width.
inline double bulge(const CurveTangent& from, const CurveTangent& to) {
  const double width = to.u - from.u;
  const double chord = (to.height - from.height) / width;
  const double left = std::abs(from.slope - chord);
  const double right = std::abs(to.slope - chord);
  return left + right > 0.0 ? width * left * right / (left + right) : 0.0;
}
inline double bulge(const CurvePiece& piece, double from, double to) {
  return piece.straight() ? 0.0 : bulge(piece.tangent(from), piece.tangent(to));
}

/// Bounds of a − b between two places where both are defined.
struct PieceDifference {
  double at_from = 0.0, at_to = 0.0;  ///< At both places.
  double low = 0.0, high = 0.0;       ///< Bounds in between.
  bool monotone = false;              ///< Certainly rises or falls throughout.
};

inline PieceDifference difference(const CurvePiece& a, const CurvePiece& b, double from,
                                  double to) {
  const CurveTangent a_from = a.tangent(from);
  const CurveTangent a_to = a.tangent(to);
  const CurveTangent b_from = b.tangent(from);
  const CurveTangent b_to = b.tangent(to);
  const double bulge_a = a.straight() ? 0.0 : bulge(a_from, a_to);
  const double bulge_b = b.straight() ? 0.0 : bulge(b_from, b_to);
  PieceDifference result;
  result.at_from = a_from.height - b_from.height;
  result.at_to = a_to.height - b_to.height;
  result.high = std::max(result.at_from, result.at_to) + (a.concave() ? bulge_a : 0.0) +
                (b.concave() ? 0.0 : bulge_b);
  result.low = std::min(result.at_from, result.at_to) - (a.concave() ? 0.0 : bulge_a) -
               (b.concave() ? bulge_b : 0.0);
  // Slopes rise or fall all the way.
  const double least = std::min(a_from.slope, a_to.slope) - std::max(b_from.slope, b_to.slope);
  const double most = std::max(a_from.slope, a_to.slope) - std::min(b_from.slope, b_to.slope);
  result.monotone = least > 0.0 || most < 0.0;
  return result;
}

/// Upper envelope of concave curve pieces over one coordinate, stored as its pieces.
class CurveEnvelope {
 public:
  void clear() {
    pieces_.clear();
    ends_.clear();
  }
  /// @pre piece.concave() and piece.begin ≤ piece.end.
  void insert(const CurvePiece& piece);
  /// In order, without overlaps; with gaps where nothing was inserted. Error against the largest
  /// value: kEnvelopeTie (CurveEnvelope.IsTheLargestOfItsPieces).
  [[nodiscard]] const std::vector<CurvePiece>& pieces() const { return pieces_; }

 private:
  /// Heights of a piece at its ends, mm.
  struct Ends {
    double begin = 0.0, end = 0.0;
  };

  static Ends ends_of(const CurvePiece& piece);
  [[nodiscard]] bool may_rise_above(const CurvePiece& fresh, const CurveTangent& tangent,
                                    std::size_t i) const;
  void keep(std::size_t i);
  void append(const CurvePiece& piece, double from, double to);
  void contest(const CurvePiece& old, const CurvePiece& fresh, double from, double to);

  std::vector<CurvePiece> pieces_;
  std::vector<Ends> ends_;  ///< One per piece.
  std::vector<CurvePiece> merged_;
  std::vector<Ends> merged_ends_;
};

/// Curves closer than this, mm, count as equal: rounding of a height is 1e-13.
inline constexpr double kEnvelopeTie = 1e-12;
/// Pieces shorter than this, mm, are replaced by their neighbours: at a slope of 10 the height
/// error is 1e-10 mm.
inline constexpr double kShortestPiece = 1e-11;

/// The exact height of a ball's tip along a line: the upper envelope of the curves on which single
/// facets (straight), edges (arcs of ellipses) and vertices (arcs of circles) hold the ball.
///
/// The pieces are in order; there are none where nothing is under the ball. Equal to
/// DropCutter::drop() everywhere to 1e-9 mm (DropCurve.EqualsTheDropCutter…), and to 1e-12 except
/// where a wall falls off steeper than the ball's own flank.
std::vector<CurvePiece> drop_curve(const DropCutter& cutter, const AxisLine& line, double from,
                                   double to);

}  // namespace lensforge
