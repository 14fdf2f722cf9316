// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// How the part is cut and polished that a design is to be right for; lengths in mm. A ball-end
/// mill's rows, then an average with a Gaussian, as PolishedField has it.
struct MadeBy {
  double pitch = 0.06;         ///< Between neighbouring rows, > 0.
  bool rows_along_x = true;    ///< Else along y.
  double ball_radius = 0.2;    ///< Of the mill, > 0.
  double polish_sigma = 0.03;  ///< Of the Gaussian, > 0.
  double rim_depth = 0.0;      ///< Taken off in addition at the rim, ≥ 0.
  double rim_length = 1.0;     ///< Distance over which that falls to 1/e of itself, > 0.

  /// Share of the ball's own curvature that a design's valleys have at most: through as sharp ones
  /// it rolls (SmoothBed::kMaxBend), with a margin for what control points do not tell.
  static constexpr double kSharpestValley = 0.75;
  /// Second derivative of a valley at most, 1/mm.
  [[nodiscard]] double sharpest_valley() const { return kSharpestValley / ball_radius; }

  friend bool operator==(const MadeBy&, const MadeBy&) = default;
};

}  // namespace lensforge
