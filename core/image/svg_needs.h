// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// What an SVG file needs beyond itself.
struct SvgNeeds {
  /// In plain words: fonts that are not installed and what is taken instead, files that it refers
  /// to. Each once.
  std::vector<std::string> remarks;
  std::string problem;  ///< Why its text cannot be drawn at all; empty if it can.
};

/// Looks the text of a file up in the installed fonts (fontconfig). A font counts as there if one
/// of the families that the text names is there, or a generic one. @param xml  well formed or not.
SvgNeeds svg_needs(std::string_view xml);

}  // namespace lensforge
