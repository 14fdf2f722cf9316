// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"

/// A forward ray tracer over Embree that judges a designed lens from outside: it shares the lens's
/// files with the program, but neither its optics nor its rasteriser nor its pixel conventions.
namespace lensforge::bench {

struct RayTraceOptions {
  SurfaceModel model = SurfaceModel::kFacet;  ///< Normal of the facet, or between its corners'.
  std::int64_t rays = 0;                      ///< 0 takes default_rays().
  std::uint64_t seed = 1;
};

/// Counts of the rays by destination, and their picture.
struct RayTraceResult {
  Image render;          ///< Linear light relative to the target's white, as render.exr.
  ImageMetrics metrics;  ///< Against the lens's target.
  /// Mean absolute error that sampling alone leaves in the display-encoded picture: half the
  /// difference between the pictures of two independent halves of the rays.
  double noise = 0.0;
  std::int64_t rays = 0;       ///< Rays sent: rounded up so that they fill two grids of strata.
  std::int64_t missed = 0;     ///< Found no surface above them.
  std::int64_t trapped = 0;    ///< Totally reflected, or bent back: never reach the plane.
  std::int64_t met_again = 0;  ///< Met the lens a second time after leaving it; counted as landed.
  double seconds = 0.0;
};

/// 16,384 rays a pixel, within 2^28 … 2^31: noise below 0.3e-3 (ray_trace prints what it is).
std::int64_t default_rays(const OpticalSetup& setup);

/// Sends parallel rays up through the lens, one at a random place in every cell of a fine grid over
/// it, bends each by Snell's law where it leaves and counts it in the pixel where it lands. The
/// same counts for any number of threads.
///
/// Embree (single precision) only says which triangle a ray meets; place, normal and direction are
/// computed in double precision. A ray within 1e-5 mm of an edge may be given to the neighbour: one
/// in ten thousand at most on facets of 0.1 mm.
///
/// @throw RunError if Embree cannot be started.
RayTraceResult trace_rays(const Lens& lens, const RayTraceOptions& options,
                          const Executor& executor);

}  // namespace lensforge::bench
