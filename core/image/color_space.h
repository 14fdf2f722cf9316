// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

namespace lensforge {

/// Encoding of light by the numbers in a picture file.
struct ColorSpace {
  enum class Curve { kLinear, kSrgb, kRec709, kGamma };
  Curve curve = Curve::kSrgb;
  double gamma = 1.0;  ///< For Curve::kGamma: light = value^gamma.

  friend bool operator==(const ColorSpace&, const ColorSpace&) = default;
};

/// Understands OpenImageIO's names: "sRGB", "linear", "Rec709", "GammaX.Y" and their aliases, in
/// any case; nothing for an unknown one.
std::optional<ColorSpace> parse_color_space(const std::string& name);

/// Stored value (1 is white) → linear light.
double to_linear(double stored, const ColorSpace& space);

}  // namespace lensforge
