// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <istream>
#include <optional>
#include <string>

namespace lensforge {

/// Size from the first chunk of a PNG stream.
struct PngSize {
  unsigned columns = 0;
  unsigned rows = 0;
};

/// Reads signature and header; nothing without the signature, zeros if the header is cut off.
std::optional<PngSize> read_png_size(std::istream& file);

/// A PNG stream reduced to the chunks that affect its picture, or why that cannot be done.
struct EssentialPng {
  std::string bytes;
  std::string problem;        ///< "is truncated", ...; empty if every chunk was whole.
  std::string color_profile;  ///< Name of an embedded ICC profile; empty without one.
  bool animated = false;      ///< An APNG; `bytes` holds only its default picture.
};

/// Reads a PNG stream from its start to the end chunk and checks every chunk's length and CRC.
/// @pre read_png_size() recognised it.
EssentialPng read_essential_png(std::istream& file);

}  // namespace lensforge
