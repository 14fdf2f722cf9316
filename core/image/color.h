// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/compute/host_device.h"
#include "core/image/image.h"

namespace lensforge {

// The program's only display transfer curve: sRGB (IEC 61966-2-1) with its linear toe, which keeps
// the slope at black finite. Beyond 1 the power law continues; below 0 it is odd.

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

/// What is kept of red, green and blue light. All of it is exact for grey, where the weighted sum
/// of equal channels rounds.
inline double grey_light(const std::array<double, 3>& light, KeptLight kept = KeptLight::kAll) {
  if (kept == KeptLight::kRed) return light[0];
  if (kept == KeptLight::kGreen) return light[1];
  if (kept == KeptLight::kBlue) return light[2];
  return light[0] == light[1] && light[1] == light[2] ? light[0] : luminance_rec709(light);
}

// Colour spaces of files, and colours of wavelengths.

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

/// Range of visible wavelengths, nm.
inline constexpr double kMinWavelength = 380.0;
inline constexpr double kMaxWavelength = 780.0;

/// The CIE 1931 colour matching functions x̄, ȳ, z̄ at a wavelength in nm, as sums of Gaussians
/// (Wyman, Sloan and Shirley 2013), within 1 % of the peak. ȳ is the luminosity function V(λ).
Eigen::Vector3d color_matching(double wavelength);

/// Each wavelength's share of a source's brightness, power × V(λ); their sum is 1.
/// @param powers  one per wavelength, or none if all are equal.
std::vector<double> brightness_shares(const std::vector<double>& wavelengths,
                                      const std::vector<double>& powers = {});

/// Weighted sum of the pictures. @pre equal sizes, one picture per share.
Image mixed(const std::vector<Image>& pictures, const std::vector<double>& shares);

/// sRGB picture of single-wavelength pictures together: white where all of them are 1. Colours
/// outside sRGB are clipped. @pre equal sizes, one picture per wavelength.
ColorImage color_picture(const std::vector<Image>& pictures, const std::vector<double>& wavelengths,
                         const std::vector<double>& powers = {});

// A coloured picture as the sum of three lamps' pictures.

/// Pictures in the light of three lamps of one wavelength each.
struct LampPictures {
  std::array<double, 3> wavelengths{};  ///< nm
  /// Luminance of each lamp where its picture is 1; 1 is that of white.
  std::array<double, 3> brightness{};
  std::array<Image, 3> pictures;  ///< Linear, at most 1.
};

/// The lamps' light that adds up to a picture.
struct LampSplit {
  LampPictures lamps;
  /// Share of the pixels whose colour is outside the lamps' triangle: a lamp would have to give
  /// less than no light, and gives none.
  double outside = 0.0;
};

/// Splits a picture. @param rgb  linear red, green and blue of sRGB.
/// @pre lamps_mix_white().
LampSplit split_by_lamps(const std::array<Image, 3>& rgb, const std::array<double, 3>& wavelengths);

/// True if white can be mixed of light of these wavelengths, nm.
bool lamps_mix_white(const std::array<double, 3>& wavelengths);

/// CIE 1931 X, Y and Z of every pixel, Y 1 at white D65.
std::vector<float> tristimulus(const std::array<Image, 3>& rgb);
std::vector<float> tristimulus(const LampPictures& lamps);

/// The sRGB picture of tristimulus values; colours outside sRGB are clipped.
ColorImage color_picture(std::span<const float> xyz, int columns, int rows);

}  // namespace lensforge
