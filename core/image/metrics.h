// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/image/image.h"

namespace lensforge {

/// Differences between a projected picture and its target (docs/interface.md, "Metrics").
struct ImageMetrics {
  double mae = 0.0;   ///< Mean absolute error of the display-encoded values, 0 … 1.
  double psnr = 0.0;  ///< Peak signal-to-noise ratio of the same, dB; +inf when equal.
  /// Mean structural similarity of the same with 7 × 7 uniform windows, K1 = 0.01, K2 = 0.03,
  /// sample covariance (Wang et al. 2004; scikit-image's structural_similarity, data_range = 1).
  /// Pictures smaller than a window use the largest odd window that fits.
  double ssim = 0.0;
  double mae_linear = 0.0;   ///< Mean absolute error of linear flux ÷ largest target flux.
  double flux_inside = 1.0;  ///< Share of the flux that lands on the image rectangle.
};

/// Compares `render` with `target`, both linear light relative to the same white. Sets all but
/// flux_inside. @pre equal sizes.
ImageMetrics compare(const Image& render, const Image& target);

}  // namespace lensforge
