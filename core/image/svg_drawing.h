// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"

namespace lensforge {

/// Maximum size of an SVG file, bytes; for a packed one (.svgz) also of its content.
inline constexpr std::uintmax_t kMaxSvgBytes = std::uintmax_t{32} << 20U;

/// Maximum sample points per side in every pixel of a drawing; fewer for large pictures.
inline constexpr int kSvgSamples = 4;

/// Limits of the child process that draws a file: computing time of all threads, s, and bytes, plus
/// the pictures of the drawing's size that a filter may hold. With 4096 points per side, 200
/// blurred circles took 43 s, 30 MB of 380,000 shapes 0.85 GB.
inline constexpr double kSvgSeconds = 240.0;
inline constexpr double kSvgMemory = 4e9;
inline constexpr double kSvgSurfaces = 12.0;

/// True if a file begins like SVG: an XML text, packed with gzip or not, in UTF-16 or an
/// ASCII-compatible encoding, whose first element is svg.
bool is_svg(std::istream& file);

/// An SVG file as pixels.
struct SvgPicture {
  Image light;          ///< Linear light in front of black, by default the luminance.
  Image coverage;       ///< Alpha: 1 opaque, 0 transparent.
  bool colour = false;  ///< True if colours were turned to grey.
  /// Changes in plain words: fonts that are not installed, pictures turned upright.
  std::vector<std::string> remarks;
  /// In plain words, what is not drawn as specified and what to do about it.
  std::vector<std::string> left_out;
};

/// Draws SVG 1.1, and the parts of SVG 2 that librsvg supports, in the file's proportions, at least
/// one pixel per side. Every pixel is the mean over up to kSvgSamples² points, in linear light.
/// Files and addresses that it refers to are not opened; embedded pictures are drawn. Drawing runs
/// in a child process, so a file that crashes the libraries does no harm.
/// @pre longer_side ≥ 1
/// @throw InputError naming the file if it is missing, longer than kMaxSvgBytes, no SVG, has no
///        size, needs a character that no installed font has, crashes the libraries, exceeds the
///        time or memory limits above, or needs a picture larger than kMaxImageSide or the memory.
///        Interrupted within 0.1 s.
/// @param kept  the light of `light`.
SvgPicture draw_svg(const std::filesystem::path& path, int longer_side, const RunControl& run = {},
                    KeptLight kept = KeptLight::kAll);

}  // namespace lensforge
