// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "core/optics/optical_setup.h"

namespace lensforge {

/// An SVG element of a page that says how to set the part up: lamp, part, screen and viewer from
/// the side (y up) and from above (x up), z to the right in both, and the places in words. It is to
/// scale unless the part would be too small to see; then all lies in its true direction from the
/// middle of the part, but far things are drawn nearer, and the drawing says so.
/// @param part_height  of the part above z = 0, mm.
std::string light_drawing(const OpticalSetup& setup, double part_height);

/// The same as a file of its own.
std::string light_drawing_file(const OpticalSetup& setup, double part_height);

}  // namespace lensforge
