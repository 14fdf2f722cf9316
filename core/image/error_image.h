// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "core/image/image.h"
#include "core/image/image_io.h"

namespace lensforge {

/// False colour for `share`, clipped to 0 … 1: from black through violet, red and yellow to near
/// white, with increasing lightness.
std::array<unsigned char, 3> false_color(double share);

/// Values ≥ 0 in false colour, each pixel enlarged by a whole factor so that the shorter side has
/// at least 256, with a colour bar and its labels at the right. The scale runs from 0 to the 99.5th
/// percentile of the values, rounded up to 1, 2 or 5 times a power of ten, 0.001 at least; values
/// above it show the bar's top colour, and the top label then reads ">…".
/// @param values  columns × rows, row by row from the top. @pre neither is 0.
ColorImage false_color_image(const std::vector<double>& values, int columns, int rows);

/// |encode(render) − encode(target)| as a false_color_image(). @pre equal sizes.
ColorImage error_image(const Image& render, const Image& target);

}  // namespace lensforge
