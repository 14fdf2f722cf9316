// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <string>

namespace lensforge {

/// What the first bytes of a picture file tell without a decoder.
struct PictureOutline {
  std::string format;        ///< OpenImageIO's name of it: "png", "jpeg", …
  std::int64_t columns = 0;  ///< 0 where the first bytes do not tell it.
  std::int64_t rows = 0;
  bool animated = false;
  std::string problem;  ///< Why a decoder must not be trusted with it; empty if it may.
};

/// The formats that are read, as a sentence has them.
inline constexpr const char* kReadableFormats =
    "PNG, JPEG, TIFF, OpenEXR, Radiance HDR, PNM, BMP, GIF, WebP, HEIF and SVG";

/// Recognises the formats of pixels that are read by their first bytes, and looks up the size of
/// those whose decoders take memory for a whole picture on opening. Nothing for any other file.
std::optional<PictureOutline> read_picture_outline(std::istream& file);

}  // namespace lensforge
