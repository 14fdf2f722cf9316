// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

namespace lensforge {

/// Luminance of red, green and blue light (ITU-R BT.709-6, item 3.2).
inline double luminance_rec709(const std::array<double, 3>& light) {
  return 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
}

}  // namespace lensforge
