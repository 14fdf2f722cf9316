// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// The text of an SVG file with the pictures in its data: addresses as librsvg (2.54) draws them
/// right: those that Exif turns are turned and written as PNG, and a type that is not theirs is
/// taken out of their address. All else stays as it is. @param remarks  gets what was turned.
/// @pre No other thread uses gdk-pixbuf.
std::string with_fit_pictures(const std::string& xml, std::vector<std::string>& remarks);

/// What is left out of a picture at a data: address, in plain words; empty if it is drawn whole and
/// upright.
std::string undrawn_of_picture(std::string_view address);

/// The text of a drawing at a data: address; empty if there is none.
std::string drawing_at(std::string_view address);

}  // namespace lensforge
