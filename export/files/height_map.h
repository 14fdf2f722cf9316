// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/optical_surface.h"

namespace lensforge {

/// Columns and rows of a height map over a rectangle.
GridShape height_map_shape(const Eigen::Vector2d& size, int longer_side);

/// Heights in mm on a raster that covers the surface's rectangle, sampled at the pixel centres,
/// seen from +z with y upwards (row 0 is the farthest). 0 where there is no surface.
/// @param longer_side  pixels on the longer side; the shorter side follows from the rectangle.
/// @throw Interrupted.
Image height_map(const OpticalSurface& surface, int longer_side, const Executor& executor,
                 const RunControl& control = {});

/// Heights that stand for black and white in a grey picture.
struct GreyScale {
  double black = 0.0;  ///< mm
  double white = 0.0;  ///< mm
};

/// Writes a height map as 16-bit grey PNG, linear between the lowest and the highest value, as
/// laser and relief programs read it; whole or not at all.
/// @throw RunError if it cannot be written; Interrupted.
GreyScale write_grey_relief(const Image& heights, const std::filesystem::path& path,
                            const Executor& executor = Executor::serial(),
                            const RunControl& control = {});

}  // namespace lensforge
