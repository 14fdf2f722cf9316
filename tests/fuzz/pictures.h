// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "fuzz/random.h"

/// Pictures drawn by the campaign itself. Their checksums are valid: faults are found only after
/// the first checks.
namespace lensforge::fuzz {

/// A PNG with an odd size, depth, colour type, palette, chunk, text, order or amount of data.
std::string odd_png(Random& random);
/// A PGM or PPM, of text or bytes, with an odd size, maximum or value.
std::string odd_pnm(Random& random);
/// A BMP with one of its headers, odd masks, palette, runs or order of rows.
std::string odd_bmp(Random& random);
/// A WebP file with an odd profile and odd Exif around the pixels of a good one.
std::string with_odd_metadata(const std::string& webp, Random& random);
/// BMP, GIF, ICO, TGA or TIFF: little more than a header, with odd numbers in it.
std::string odd_small_picture(const std::string& extension, Random& random);

/// A PFM of heights below 0 with an odd size, byte order or value among them.
std::string odd_heights(Random& random);

}  // namespace lensforge::fuzz
