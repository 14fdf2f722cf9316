// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

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

}  // namespace lensforge
