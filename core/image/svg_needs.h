// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// Returns the text of an SVG file with the pictures in its data: addresses changed so that librsvg
/// (2.54) draws them correctly: pictures with an Exif orientation are turned upright and written as
/// PNG, and a wrong type is removed from an address. All else is unchanged. @param remarks  gets
/// the pictures turned.
/// @pre No other thread uses gdk-pixbuf.
std::string with_fit_pictures(const std::string& xml, std::vector<std::string>& remarks);

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
