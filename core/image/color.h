// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/image/image.h"

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

}  // namespace lensforge
