// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>

#include "core/compute/host_device.h"

/// The program's only display transfer curve: sRGB (IEC 61966-2-1) with its linear toe, which keeps
/// the slope at black finite. Beyond 1 the power law continues; below 0 it is odd.
namespace lensforge {

inline constexpr double kSrgbToeSlope = 12.92;
inline constexpr double kSrgbToeEnd = 0.0031308;  ///< Linear value where the toe ends.

/// Linear light → display-encoded value; both 1 at white.
LF_HD inline double encode(double linear) {
  if (linear <= kSrgbToeEnd) return kSrgbToeSlope * linear;
  return 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

/// Derivative of encode().
LF_HD inline double encode_slope(double linear) {
  if (linear <= kSrgbToeEnd) return kSrgbToeSlope;
  return 1.055 / 2.4 * std::pow(linear, 1.0 / 2.4 - 1.0);
}

/// Display-encoded value → linear light; the inverse of encode() to 1e-7 (the standard's rounding).
LF_HD inline double decode(double encoded) {
  if (encoded <= kSrgbToeSlope * kSrgbToeEnd) return encoded / kSrgbToeSlope;
  return std::pow((encoded + 0.055) / 1.055, 2.4);
}

/// Luminance of red, green and blue light (ITU-R BT.709-6, item 3.2).
inline double luminance_rec709(const std::array<double, 3>& light) {
  return 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
}

/// The same, exact for grey: the weighted sum of equal channels rounds.
inline double grey_light(const std::array<double, 3>& light) {
  return light[0] == light[1] && light[1] == light[2] ? light[0] : luminance_rec709(light);
}

}  // namespace lensforge
