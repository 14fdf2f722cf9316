// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace lensforge {

/// How two balls share a surface so that no step is left where one takes over from the other.
///
/// Rows leave scallops, on average p²/(24 R) high, so that a surface of one ball lies higher than
/// that of the other, and lower than either where both cut. So both are held above the surface by
/// amounts that depend on how far a place is from what the larger ball leaves (RestMap): the
/// smaller one cuts on the surface there and rises by a few micrometres on the way out; the larger
/// one is as high as its scallops allow out there and rises to the smaller one's crests on the way
/// in. In between their common lower envelope has the same mean everywhere, p²/(24 r). Rows of the
/// larger ball lie on every n-th row of the smaller one's, since other pitches would beat.
///
/// Notation: p pitch of the smaller ball, n rows of it per row of the larger, R, r radii.
class BallBlend {
 public:
  struct Rows {
    double small_radius = 0.0;  ///< mm
    double large_radius = 0.0;  ///< mm
    double pitch = 0.0;         ///< Of the smaller ball, mm.
    int every = 1;              ///< n
  };

  explicit BallBlend(const Rows& rows);

  /// Of either ball above its drop curve where it touches `distance` mm from what the larger one
  /// leaves, mm, ≥ 0.
  [[nodiscard]] double small_lift(double distance) const;
  [[nodiscard]] double large_lift(double distance) const;

  /// Width of the zone where both cut, mm: five cells of the map.
  static constexpr double kWidth = 0.5;
  /// The smaller ball's rows end this far beyond it, where it is clear of the surface.
  static constexpr double kRunOut = 0.2;

 private:
  double clear_ = 0.0;              ///< Of the smaller ball at kWidth, mm.
  std::vector<double> large_lift_;  ///< At even distances 0 … kWidth.
};

}  // namespace lensforge
