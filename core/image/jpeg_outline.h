// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <istream>
#include <optional>

namespace lensforge {

/// Properties of a JPEG stream from its markers, without decoding.
struct JpegOutline {
  int columns = 0;
  int rows = 0;
  bool complete = false;  ///< The end-of-image marker was reached.
};

/// Walks the markers of a JPEG stream; nothing if it does not start like one.
std::optional<JpegOutline> read_jpeg_outline(std::istream& file);

}  // namespace lensforge
