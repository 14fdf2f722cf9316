// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// What an SVG file needs beyond itself and beyond what librsvg does.
struct SvgNeeds {
  /// In plain words: fonts that are not installed and what is taken instead. Each once.
  std::vector<std::string> remarks;
  /// In plain words: what is not drawn (svg_support.h), files that it refers to. Each kind once.
  std::vector<std::string> left_out;
  std::string problem;  ///< Why its text cannot be drawn at all; empty if it can.
};

/// Walks through the text of a file, of which nothing that it refers to is opened. @param xml  well
/// formed or not. @pre In a process of its own: libxml2 opens no file there any more.
SvgNeeds svg_needs(std::string_view xml);

}  // namespace lensforge
