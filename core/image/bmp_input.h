// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/imageio.h>

#include <memory>

namespace lensforge {

/// A reader of BMP pictures: 1 to 32 bits a pixel, palettes, channel masks, run-length encoding,
/// either order of rows. OpenImageIO's own (2.4) takes no heed of masks and knows no runs.
std::unique_ptr<OIIO::ImageInput> make_bmp_input();

}  // namespace lensforge
