// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "fuzz/random.h"

namespace lensforge::fuzz {

/// An SVG file that is small but takes much time or memory, or crashes its readers, or a usual one
/// with odd values; at times changed, packed or in another encoding.
std::string odd_svg(Random& random);

}  // namespace lensforge::fuzz
