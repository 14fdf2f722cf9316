// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// Needs of an SVG file beyond its own content and librsvg's features.
struct SvgNeeds {
  /// In plain words: fonts that are not installed and their replacements. Each once.
  std::vector<std::string> remarks;
  /// In plain words: what is not drawn (svg_support.h), files that it refers to. Each kind once.
  std::vector<std::string> left_out;
  std::string problem;  ///< Why its text cannot be drawn at all; empty if it can.
};

/// Walks through the text of a file without opening anything that it refers to. @param xml  well
/// formed or not. @pre Runs in a separate process: it keeps libxml2 from opening any file there.
SvgNeeds svg_needs(std::string_view xml);

}  // namespace lensforge
