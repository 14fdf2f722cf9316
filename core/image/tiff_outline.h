// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <istream>

namespace lensforge {

/// False if the stream is a TIFF whose first picture has pixel data beyond the stream's end: it is
/// truncated. True for every other stream, also for one that is no TIFF.
bool tiff_pixels_are_inside(std::istream& file);

}  // namespace lensforge
