// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// A picture of values in double precision, row by row from the top. @pre columns × rows values.
inline Image image_of(std::span<const double> values, int columns, int rows) {
  Image image(columns, rows);
  std::transform(values.begin(), values.end(), image.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  return image;
}

/// Shares of the light in every pixel, in the light of a single point or direction.
using PointPicture = std::function<std::vector<double>(const OpticalSetup&)>;

/// Points that an exact picture is summed over: the more, the wider the source's image.
int source_point_count(const OpticalSetup& setup, double z);

/// Flux per pixel under an extended source and of all colours of a spectrum: the sum of the
/// pictures in the light of each of about `count` of its points, by shares. No approximation but
/// the count.
std::vector<double> picture_under(const OpticalSetup& setup, int count,
                                  const PointPicture& picture);

/// The same picture in a convolution, source_kernel()'s.
/// @param z  of the surface, mm.
std::vector<double> picture_by_convolution(const OpticalSetup& setup, double z,
                                           const PointPicture& picture, const Executor& executor);

/// The picture that an optimiser has to aim at, so that the surface's exact one comes out as
/// `target`: the target less what its own account of the surface as it is gets wrong, at least 0.
/// @param exact, seen  shares of the light in every pixel of the target, exact and by that account.
Image corrected(const Image& target, const std::vector<double>& exact,
                const std::vector<double>& seen);

/// corrected() for an optimiser that goes by a convolution. @pre the source has an extent; target
/// has setup.pixels.
/// @param z  of the surface, mm. @param picture  what the surface projects.
Image corrected_for_convolution(const Image& target, const OpticalSetup& setup, double z,
                                const PointPicture& picture, const Executor& executor);

/// How nearly the picture of a lens under its extended source is known.
struct SourceCheck {
  double blur = 0.0;  ///< Width of the source's image on the screen, pixels.
  int points = 0;     ///< Of the source, whose pictures are summed.
  /// Mean absolute differences of display-encoded pixels between that picture and the one of half
  /// as many points, and the one that the optimiser goes by, a convolution.
  double halving = 0.0;
  double convolution = 0.0;
};

/// @pre the lens's source has an extent.
SourceCheck check_source(const Lens& lens, const Executor& executor);

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
