// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "cam/tolerance/passes.h"

namespace lensforge {

/// A value with the share of all that has it.
struct WeightedValue {
  double value = 0.0;
  double share = 0.0;
};

/// How strongly the scallops of a raster are polished.
struct RipplePolish {
  double sigma = 0.0;   ///< mm
  double within = 0.0;  ///< Standard deviation of σ over the part, a share.
};

/// The slopes (rise over run) across the rows that polishing leaves of a raster's scallops, evenly
/// over a period and over the part: their k-th harmonic keeps exp(−2π²k²σ²/p²) of its height. Of
/// rows that cross the second raster's dips are taken as the mean of what they leave.
///
/// One pixel's light comes from many periods, so that to the picture a scallop is a blur across the
/// rows of these slopes.
/// @param eccentricity  of the ball, mm, ≥ 0: it cuts flat over twice this (ErrorHeights).
std::vector<WeightedValue> ripple_slopes(const Passes& passes, double radius, double eccentricity,
                                         const RipplePolish& polish);

}  // namespace lensforge
