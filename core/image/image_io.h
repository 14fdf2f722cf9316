// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/background.h"
#include "core/image/image.h"

namespace lensforge {

/// A picture as read, and in plain words every change made to obtain grey linear light ("colour
/// turned to luminance (Rec. 709)", "transparency flattened onto black", …).
struct LoadedImage {
  Image image;
  std::vector<std::string> changes;
};

/// Maximum side of a picture; a larger file is refused before its pixels are read.
inline constexpr int kMaxImageSide = 16384;

/// Default pixels of a drawing's longer side: that of a working picture.
inline constexpr int kDrawnSide = 256;

/// Reads a picture in any of kReadableFormats (picture_outline.h), whatever its name, with any
/// channel count and depth. It is decoded by the colour profile or space that the file declares,
/// otherwise as sRGB for integers and linear for floats. Decoders run in a child process
/// (picture_child.h).
/// @param drawn_side  pixels of the longer side for an SVG file (svg_drawing.h).
/// @param background  colour behind transparent parts of the picture.
/// @throw InputError if the file is missing, no regular file, truncated, no picture, larger than
///        kMaxImageSide or the memory, holds NaN, infinite or negative values (except those that
///        kRingingShare allows), is indistinguishable from the background, or crashes its decoder;
///        the message names the file. Interrupted, at most 0.1 s after the stop request.
LoadedImage read_image(const std::filesystem::path& path, const RunControl& run = {},
                       int drawn_side = kDrawnSide, const Background& background = {});

/// Box-filter (area-weighted) resampling in linear light: the mean value is kept to 1e-6 relative.
/// Progress is reported in rows of the result. @pre columns, rows ≥ 1. @throw Interrupted.
Image resample(const Image& image, int columns, int rows, const RunControl& run = {});

/// Writes 16-bit sRGB-encoded grey PNG (clipped to 0 … 1), or, for .exr, 32-bit float linear grey.
/// The file appears whole or not at all.
/// @throw RunError if it cannot be written; InputError for another extension; Interrupted.
void write_image(const Image& image, const std::filesystem::path& path,
                 const RunControl& control = {});

/// An 8-bit sRGB colour picture, row by row from the top, three bytes per pixel.
struct ColorImage {
  int columns = 0;
  int rows = 0;
  std::vector<unsigned char> rgb;
};

/// Writes an 8-bit PNG; whole or not at all. @throw RunError if it cannot be written.
void write_image(const ColorImage& image, const std::filesystem::path& path);

/// The bytes of the same PNG. @throw RunError if it cannot be encoded.
std::vector<unsigned char> encode_png(const ColorImage& image);

}  // namespace lensforge
