// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge {

/// Shares of a pixel's flux that go −reach … reach pixels on, over a square row by row; none is
/// below 0, and their sum is 1.
struct BlurKernel {
  std::int64_t reach = 0;
  std::vector<double> share{1.0};
};

/// The blur of a picture by a source of which every place of the part makes an evenly lit disc, or
/// an ellipse with these half axes along x and y, pixels, ≥ 0. What is moved by a part of a pixel
/// is split between its neighbours, which alone would widen the blur; the disc is made so much
/// smaller that the kernel's variance is radius² / 4 along either axis, the disc's own.
BlurKernel disc_blur(const Eigen::Vector2d& radii);

/// Flux of a picture, row by row.
struct FluxRaster {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::vector<double> flux;
};

/// What is moved off the raster is lost, and nothing comes from outside of it.
FluxRaster blurred(const FluxRaster& raster, const BlurKernel& kernel, const Executor& executor);

}  // namespace lensforge
