// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "cam/contact/curve_piece.h"

namespace lensforge {

/// The largest of concave curve pieces over one coordinate, kept as the pieces that are on top.
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
  std::vector<Ends> ends_;  ///< One a piece.
  std::vector<CurvePiece> merged_;
  std::vector<Ends> merged_ends_;
};

/// Curves that are no farther apart than this, mm, are one: rounding of a height is 1e-13.
inline constexpr double kEnvelopeTie = 1e-12;
/// Pieces shorter than this, mm, are left to their neighbours: at a slope of 10 the height is off
/// by 1e-10 mm.
inline constexpr double kShortestPiece = 1e-11;

}  // namespace lensforge
