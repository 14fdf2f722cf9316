// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/compute/run_control.h"
#include "core/image/background.h"
#include "core/image/image.h"

namespace lensforge {

/// A picture as read, and in plain words everything that was changed to make it grey linear light
/// ("colour turned to luminance (Rec. 709)", "transparency flattened onto black", …).
struct LoadedImage {
  Image image;
  std::vector<std::string> changes;
};

/// Longest side and largest pixel count that are read; beyond it the file is refused before its
/// pixels are touched.
inline constexpr int kMaxImageSide = 16384;

/// Pixels of a drawing's longer side where nothing asks for others; that of a working picture.
inline constexpr int kDrawnSide = 256;

/// Reads a PNG, JPEG, TIFF, EXR or another of the formats in kReadableFormats
/// (picture_outline.h), whatever its name: any channel count and depth, decoded by the colour
/// profile or space that the file declares, else sRGB for integers, linear for floats. Decoders run
/// in a child process (picture_child.h).
/// @param drawn_side  pixels of the longer side of an SVG file, which has none of its own
///        (svg_drawing.h).
/// @param background  what shows through where the picture is transparent.
/// @throw InputError if the file is missing, no regular file, truncated, no picture, larger than
///        kMaxImageSide or than the memory, holds NaN, infinite or negative values (but for what
///        kRingingShare allows), cannot be told from the background, or crashes its decoder; the
///        message names the file. Interrupted, at most 0.1 s after the stop request.
LoadedImage read_image(const std::filesystem::path& path, const RunControl& run = {},
                       int drawn_side = kDrawnSide, const Background& background = {});

/// Box-filter (area-weighted) resampling in linear light: the mean value is kept to 1e-6 relative.
/// Reports rows of the result. @pre columns, rows ≥ 1. @throw Interrupted.
Image resample(const Image& image, int columns, int rows, const RunControl& run = {});

/// Writes 16-bit sRGB-encoded grey PNG (clipped to 0 … 1), or, for .exr, 32-bit float linear grey.
/// The file appears whole or not at all.
/// @throw RunError if it cannot be written; InputError for another extension; Interrupted.
void write_image(const Image& image, const std::filesystem::path& path,
                 const RunControl& control = {});

/// An 8-bit sRGB colour picture, row by row from the top, three bytes a pixel.
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
