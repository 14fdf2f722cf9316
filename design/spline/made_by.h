// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace lensforge {

/// Maximum mean width of knot cells, in σ of the polish, for which a design follows the made
/// surface exactly (MadeNodes). A 64² portrait on 12.5 mm with cells of 1.75 σ has MAE 0.0034 with
/// ShiftedNodes and 0.0023 with MadeNodes. The cells of a 100 mm lens of 256² are 5.2 σ wide; there
/// MadeNodes would take ten times as long.
inline constexpr double kFineKnotCell = 3.0;

/// The process that a design is made for, lengths in mm: rows of a ball-end mill, then the polish
/// of PolishedField.
struct MadeBy {
  double pitch = 0.06;         ///< Distance between neighbouring rows, > 0.
  bool rows_along_x = true;    ///< Else along y.
  double polish_sigma = 0.03;  ///< PolishTransfer::sigma, > 0.
  double rim_depth = 0.0;      ///< Additional depth polished off at the rim, ≥ 0.
  double rim_length = 1.0;     ///< Distance over which rim_depth falls to 1/e, > 0.
  /// Relative standard deviation of polish_sigma from part to part, in [0, 1).
  double polish_spread = 0.0;
  int polish_order = 2;       ///< PolishTransfer::order
  double polish_floor = 0.0;  ///< PolishTransfer::floor
  /// Roughness, which scatters light of the part; a design's shape does not depend on it.
  double roughness = 0.0;    ///< Roughness::rms, nm
  double correlation = 5.0;  ///< Roughness::correlation, µm

  /// The same process for a part that is cast in a mould cut this way and then polished: the mould
  /// is 1 / (1 − shrinkage) as large.
  [[nodiscard]] MadeBy cast(double shrinkage) const {
    MadeBy made = *this;
    made.pitch *= 1.0 - shrinkage;
    return made;
  }

  /// The parts over which a design's error is averaged: this one, or one polished less and one
  /// polished more. Two values one standard deviation from the mean match the normal distribution's
  /// moments up to the third.
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
