// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"

namespace lensforge {

class Description;

/// sRGB colour behind the transparent parts of a picture.
struct Background {
  std::array<int, 3> rgb{};  ///< 0 … 255 each; black.

  /// "black", "white" or "#RRGGBB". @throw InputError naming option, value and rule.
  static Background parse(const std::string& text);
  [[nodiscard]] std::string text() const;
  /// Linear light; 1 is white.
  [[nodiscard]] double light(KeptLight kept = KeptLight::kAll) const;

  friend bool operator==(const Background&, const Background&) = default;
};

/// Why nothing shows of a picture with transparent parts in front of its background; none if
/// something does. Follows the picture's name in a message.
std::optional<std::string> hidden_by(const Image& image, const Background& background);

/// The option for all commands that read pictures.
void describe(Description& d, Background& background);

/// A picture as read, and in plain words every change made to obtain grey linear light ("colour
/// turned to luminance (Rec. 709)", "transparency flattened onto black", …).
struct LoadedImage {
  Image image;
  std::vector<std::string> changes;
};

/// Default pixels of a drawing's longer side: that of a working picture.
inline constexpr int kDrawnSide = 256;

/// Negative values down to this share of the largest value are read as 0. Resampling filters leave
/// them beside bright areas: the negative weights of a three-lobed Lanczos filter sum to 0.27, and
/// it leaves up to 0.24 on random black and white.
inline constexpr double kRingingShare = 0.3;

/// Reads a picture in any of kReadableFormats (picture_outline.h), whatever its name, with any
/// channel count and depth. It is decoded by the colour profile or space that the file declares,
/// otherwise as sRGB for integers and linear for floats. Decoders run in a child process
/// (picture_codec.h).
/// @param drawn_side  pixels of the longer side for an SVG file (svg_drawing.h).
/// @param background  colour behind transparent parts of the picture.
/// @throw InputError if the file is missing, no regular file, truncated, no picture, larger than
///        kMaxImageSide or the memory, holds NaN, infinite or negative values (except those that
///        kRingingShare allows), is indistinguishable from the background, or crashes its decoder;
///        the message names the file. Interrupted, at most 0.1 s after the stop request.
LoadedImage read_image(const std::filesystem::path& path, const RunControl& run = {},
                       int drawn_side = kDrawnSide, const Background& background = {});

/// A coloured picture as read.
struct LoadedColors {
  std::array<Image, 3> light;  ///< Linear red, green and blue of sRGB; negative values are 0.
  std::vector<std::string> changes;
};

/// The same picture in colour; a grey one has three equal channels. @throw as read_image().
LoadedColors read_colors(const std::filesystem::path& path, const RunControl& run = {},
                         int drawn_side = kDrawnSide, const Background& background = {});

/// CIEDE2000 colour differences of pixels (Sharma, Wu and Dalal 2005), in front of white D65.
/// @param a, b  CIE 1931 tristimulus values of equally many pixels, X, Y, Z each; Y is 1 at white.
std::vector<float> color_differences(std::span<const float> a, std::span<const float> b);

/// Writes 16-bit sRGB-encoded grey PNG (clipped to 0 … 1), or, for .exr, 32-bit float linear grey.
/// The file appears whole or not at all.
/// @throw RunError if it cannot be written; InputError for another extension; Interrupted.
void write_image(const Image& image, const std::filesystem::path& path,
                 const RunControl& control = {});

/// Writes an 8-bit PNG; whole or not at all. @throw RunError if it cannot be written.
void write_image(const ColorImage& image, const std::filesystem::path& path);

/// The bytes of the same PNG. @throw RunError if it cannot be encoded.
std::vector<unsigned char> encode_png(const ColorImage& image);

}  // namespace lensforge
