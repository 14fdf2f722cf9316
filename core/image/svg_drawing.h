// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <string>
#include <vector>

#include "core/compute/run_control.h"
#include "core/image/image.h"

namespace lensforge {

/// Longest SVG file that is drawn, bytes; of a packed one (.svgz), of what is in it.
inline constexpr std::uintmax_t kMaxSvgBytes = std::uintmax_t{32} << 20U;

/// Points a side in every pixel of a drawing, where the picture is not too large for as many.
inline constexpr int kSvgSamples = 4;

/// What drawing a file may take in its child process: computing time of all threads, s, and bytes,
/// to which as many pictures of the drawing's size come as a filter may hold. Drawn with 4096
/// points a side, 30 MB of 380,000 shapes took 21 s and 0.85 GB, 1,000 lines of text 2 s and
/// 0.1 GB, and 200 blurred circles 43 s and 0.3 GB.
inline constexpr double kSvgSeconds = 240.0;
inline constexpr double kSvgMemory = 4e9;
inline constexpr double kSvgSurfaces = 12.0;

/// Whether a file begins as SVG does: an XML text, packed with gzip or not, in UTF-16 or an
/// encoding that ASCII is part of, whose first element is svg.
bool is_svg(std::istream& file);

/// A file of lines and areas as pixels.
struct SvgPicture {
  Image light;          ///< Luminance in linear light in front of black.
  Image coverage;       ///< Alpha: 1 where the drawing hides what is behind it, 0 where it is open.
  bool colour = false;  ///< Whether colours were turned to grey.
  /// In plain words what was changed: fonts that are not installed, pictures turned upright.
  std::vector<std::string> remarks;
  /// In plain words what is not drawn as the file says, and what to do about it.
  std::vector<std::string> left_out;
};

/// Draws SVG 1.1, and what librsvg knows of SVG 2, in the file's proportions, at least one pixel a
/// side. Every pixel is the mean over up to kSvgSamples² points, in linear light. No file and no
/// address that it refers to is opened; pictures inside of it are drawn. All of it is done in a
/// child process, so that a file may crash the libraries.
/// @pre longer_side ≥ 1
/// @throw InputError naming the file if it is missing, longer than kMaxSvgBytes, no SVG, has no
///        size, needs a character that no installed font has, crashes the libraries, needs more
///        time or memory than above, or a picture larger than kMaxImageSide or the memory.
///        Interrupted within 0.1 s.
SvgPicture draw_svg(const std::filesystem::path& path, int longer_side, const RunControl& run = {});

}  // namespace lensforge
