// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cam/tolerance/ripple.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Shares of a pixel's flux that go −reach … reach pixels on; along a line, or over a square row by
/// row. Their sum is 1.
struct BlurKernel {
  std::int64_t reach = 0;
  std::vector<double> share;
};

/// A blur along one axis: light is moved by these distances, in pixels. Every distance is laid on
/// six pixels so that moments up to the fifth are its own (Lagrange): a blur of a tenth of a pixel
/// is a tenth of a pixel wide. LineBlur.* in its test.
BlurKernel line_blur(std::span<const WeightedValue> distances);

/// A blur by an evenly lit disc of this radius, in pixels, likewise.
BlurKernel disc_blur(double radius);

/// Flux of a picture, row by row.
struct FluxRaster {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::vector<double> flux;
};

/// Blurs along x (axis 0) or y. What is moved off the raster is lost, and nothing comes from
/// outside of it.
FluxRaster blurred_along(const FluxRaster& raster, int axis, const BlurKernel& kernel,
                         const Executor& executor);
/// Blurs by a square kernel.
FluxRaster blurred(const FluxRaster& raster, const BlurKernel& kernel, const Executor& executor);

}  // namespace lensforge
