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
#include "design/render.h"

namespace lensforge {

/// Picture from values in double precision, row by row from the top. @pre columns × rows values.
inline Image image_of(std::span<const double> values, int columns, int rows) {
  Image image(columns, rows);
  std::transform(values.begin(), values.end(), image.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  return image;
}

/// Computes the share of the light in every pixel, lit from a single point or direction.
using PointPicture = std::function<std::vector<double>(const OpticalSetup&)>;

/// Number of source points for an exact picture; it grows with the width of the source's image.
int source_point_count(const OpticalSetup& setup, double z);

/// Flux per pixel under an extended source and all colours of a spectrum: the weighted sum of the
/// pictures under about `count` of its points. The number of points is the only approximation.
/// @param control  takes a report of every point's picture.
std::vector<double> picture_under(const OpticalSetup& setup, int count, const PointPicture& picture,
                                  const RunControl& control = {});

/// The same picture by a convolution with source_kernel().
/// @param z  of the surface, mm.
std::vector<double> picture_by_convolution(const OpticalSetup& setup, double z,
                                           const PointPicture& picture, const Executor& executor);

/// A point's picture by few and by many rays.
struct RayPictures {
  PointPicture few;
  PointPicture many;
};

/// picture_under() with few rays from every point, and by convolution what more rays change.
/// @param z  of the surface, mm.
std::vector<double> picture_under_few_rays(const OpticalSetup& setup, double z, int count,
                                           const RayPictures& rays, const Executor& executor,
                                           const RunControl& control = {});

/// Picture to optimise for, so that the exact picture becomes `target`: the target minus the
/// current error of the optimiser's own approximation, at least 0.
/// @param exact, seen  shares of the light in every pixel of the target, exact and as approximated.
Image corrected(const Image& target, const std::vector<double>& exact,
                const std::vector<double>& seen);

/// flux_of_lens() under about `count` of the source's points.
std::vector<double> flux_under_source(const Lens& lens, const OpticalSetup& setup, int count,
                                      const Executor& executor, const RunControl& control = {});

/// @pre the lens's source has an extent.
SourceCheck check_source(const Lens& lens, const Executor& executor,
                         const RunControl& control = {});

/// The best picture that any surface can project under an extended source, assuming that light is
/// even within each part of a pixel (SourceKernel) and that one kernel holds for the whole lens.
struct SourceLimit {
  Image light;           ///< μ: picture of such a surface under a point source.
  ImageMetrics metrics;  ///< k∗μ against the target.
};

/// Minimises Σ (g − g̃)² over μ ≥ 0 with Σμ = Σ target, where g is the display-encoded k∗μ and g̃
/// the display-encoded target: the limit of the PSNR, and of E_img of Sun et al., Eq. 5. All of the
/// lens's light is on the picture before the blur.
/// @param z  of the surface, mm. @pre the source has an extent; target has setup.pixels.
/// @throw Interrupted if the executor is stopped.
SourceLimit source_limit(const Image& target, const OpticalSetup& setup, double z,
                         const Executor& executor);

}  // namespace lensforge
