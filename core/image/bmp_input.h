// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/imageio.h>

#include <memory>

namespace lensforge {

/// Returns a reader of BMP pictures: 1 to 32 bits per pixel, palettes, channel masks, run-length
/// encoding, either order of rows. OpenImageIO's own (2.4) ignores masks and does not support
/// run-length encoding.
std::unique_ptr<OIIO::ImageInput> make_bmp_input();

}  // namespace lensforge
