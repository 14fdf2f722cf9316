// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/leakage/leakage.h"

namespace lensforge {

/// How far half the spacing of the samples would move the figures of a part: about their error.
struct SamplingCheck {
  double spacing = 0.0;  ///< Of the samples, mm.
  double leakage = 0.0;  ///< Of the part at half the spacing − as measured; estimated.
  double mae = 0.0;      ///< Likewise of its display-encoded mean absolute error.
};

/// Renders kSamplingWindows² windows that lie evenly over the lens with half the spacing and
/// extrapolates what that changes to the whole lens. Costs about a fifth of the two surfaces'
/// pictures for 128² pixels and less for more.
/// @param designed, part  the first and the last surface of the chain that `result` is of.
/// @param target  with the setup's pixels.
/// @throw Interrupted.
SamplingCheck check_sampling(const SurfaceField& designed, const SurfaceField& part,
                             const LeakageResult& result, const Image& target,
                             const FieldRenderSetup& setup, const Executor& executor,
                             const RunControl& control);

/// Windows along a side of the lens.
inline constexpr int kSamplingWindows = 6;

/// Side of a window, in pixels as wide as if lens and picture were one: only pixels whose light
/// comes from the window as a whole tell what leaks.
inline constexpr double kWindowPixels = 4.0;

}  // namespace lensforge
