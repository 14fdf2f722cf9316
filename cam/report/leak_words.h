// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "cam/leakage/leak_map.h"

namespace lensforge {

/// The cause with the largest part of a place's leakage; empty without parts.
std::string main_cause(const LeakPlace& place);

/// A place in plain words: what is wrong with the surface there, how much light leaks and into
/// what, and what would help, if remedies were tried. "The groove at x 41.2 y 37.5 keeps 4.0 µm;
/// 1.30 % of the light leaks from here, 0.900 % into dark parts of the picture. A 0.3 mm ball would
/// halve it, to 0.640 %."
std::string leak_words(const LeakPlace& place);

}  // namespace lensforge
