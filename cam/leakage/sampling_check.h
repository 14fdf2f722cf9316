// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "cam/leakage/leakage.h"

namespace lensforge {

/// How far a finer grid would move the figures of a part.
struct SamplingCheck {
  Eigen::Vector2d spacing{0.0, 0.0};  ///< Of the grid, mm.
  double leakage = 0.0;  ///< Estimated error of the part's leakage: exact − measured.
  double mae = 0.0;      ///< Likewise of its display-encoded mean absolute error.
};

/// Renders kSamplingWindows² windows that lie evenly over the lens with half the spacing and
/// extrapolates what that changes to the whole lens and to a spacing of 0 (Richardson, second
/// order). Costs about a tenth of one surface's picture.
/// @param part    the last surface of the chain that `result` is of.
/// @param target  with the setup's pixels.
/// @throw Interrupted.
SamplingCheck check_sampling(const SurfaceField& part, const LeakageResult& result,
                             const Image& target, const FieldRenderSetup& setup,
                             const Executor& executor, const RunControl& control);

/// Windows along a side of the lens, each this part of its share of the side wide: 1/64 of the
/// lens's area in all.
inline constexpr int kSamplingWindows = 4;
inline constexpr int kWindowShare = 8;

}  // namespace lensforge
