// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <string>

namespace lensforge {

/// Properties of a picture file from its first bytes, without a decoder.
struct PictureOutline {
  std::string format;        ///< OpenImageIO's name: "png", "jpeg", …
  std::int64_t columns = 0;  ///< 0 if not in the first bytes.
  std::int64_t rows = 0;
  bool animated = false;
  std::string problem;  ///< Why a decoder must not open it; empty if it may.
};

/// The readable formats, for use in a sentence.
inline constexpr const char* kReadableFormats =
    "PNG, JPEG, TIFF, OpenEXR, Radiance HDR, PNM, BMP, GIF, WebP, HEIF and SVG";

/// Recognises the readable raster formats by their first bytes, and reads the size for those whose
/// decoders allocate a whole picture on opening. Nothing for any other file.
std::optional<PictureOutline> read_picture_outline(std::istream& file);

}  // namespace lensforge
