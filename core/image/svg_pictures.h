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

/// In plain words, what is left out of a picture at a data: address; empty if it is drawn whole and
/// upright.
std::string undrawn_of_picture(std::string_view address);

/// The text of a drawing at a data: address; empty if there is none.
std::string drawing_at(std::string_view address);

}  // namespace lensforge
