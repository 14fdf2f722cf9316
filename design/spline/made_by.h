// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace lensforge {

/// Mean width of knot cells in σ of the polish, up to which a design follows exactly what is made
/// of a spline (MadeNodes). A 64² portrait on 12.5 mm with cells of 1.75 σ has 0.0034 with
/// ShiftedNodes and 0.0023 with MadeNodes; those of a 100 mm lens of 256² are 5.2 σ wide, where
/// MadeNodes would take ten times as long.
inline constexpr double kFineKnotCell = 3.0;

/// How the part is cut and polished that a design is to be right for; lengths in mm. A ball-end
/// mill's rows, then an average with a Gaussian, as PolishedField has it.
struct MadeBy {
  double pitch = 0.06;         ///< Between neighbouring rows, > 0.
  bool rows_along_x = true;    ///< Else along y.
  double polish_sigma = 0.03;  ///< Of the Gaussian, > 0.
  double rim_depth = 0.0;      ///< Taken off in addition at the rim, ≥ 0.
  double rim_length = 1.0;     ///< Distance over which that falls to 1/e of itself, > 0.
  /// Share by which polish_sigma differs from part to part, standard deviation, in [0, 1).
  double polish_spread = 0.0;

  /// The same of a part that is cast in a mould which is cut so, and polished then: the mould is
  /// 1 / (1 − shrinkage) as large.
  [[nodiscard]] MadeBy cast(double shrinkage) const {
    MadeBy made = *this;
    made.pitch *= 1.0 - shrinkage;
    return made;
  }

  /// The parts over which a design's error is averaged: this one, or one that is polished less and
  /// one that is polished more. Two values a standard deviation from the mean have the normal
  /// distribution's moments up to the third.
  [[nodiscard]] std::vector<MadeBy> drawn() const {
    if (polish_spread == 0.0) return {*this};
    std::vector<MadeBy> parts{*this, *this};
    parts[0].polish_sigma *= 1.0 - polish_spread;
    parts[1].polish_sigma *= 1.0 + polish_spread;
    for (MadeBy& part : parts) part.polish_spread = 0.0;
    return parts;
  }

  friend bool operator==(const MadeBy&, const MadeBy&) = default;
};

}  // namespace lensforge
