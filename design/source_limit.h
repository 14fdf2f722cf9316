// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// The best picture that an extended source lets any surface make, as far as light is even within
/// each part of a pixel (SourceKernel) and one kernel holds for all of the lens.
struct SourceLimit {
  Image light;           ///< μ: what such a surface would project in the light of a point.
  ImageMetrics metrics;  ///< Of k∗μ against the target.
};

/// min Σ (g − g̃)² over μ ≥ 0 with Σμ = Σ target, g = the display-encoded k∗μ, g̃ the display-encoded
/// target: the limit of the PSNR, and of E_img of Sun et al., Eq. 5. All of the lens's light is on
/// the picture before the blur.
/// @param z  of the surface, mm. @pre the source has an extent; target has setup.pixels.
/// @throw Interrupted if the executor is stopped.
SourceLimit source_limit(const Image& target, const OpticalSetup& setup, double z,
                         const Executor& executor);

}  // namespace lensforge
