// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/image/image.h"
#include "core/image/image_io.h"

namespace lensforge {

/// Of what the eye sees, nm.
inline constexpr double kMinWavelength = 380.0;
inline constexpr double kMaxWavelength = 780.0;

/// The CIE 1931 colour matching functions x̄, ȳ, z̄ at a wavelength in nm, by the sums of Gaussians
/// of Wyman, Sloan and Shirley (2013), which are within 1 % of the peak. ȳ is V(λ), the brightness
/// of light.
Eigen::Vector3d color_matching(double wavelength);

/// Shares of the brightness of a source that its wavelengths have, power × V(λ); their sum is 1.
/// @param powers  one per wavelength, or none where all have the same.
std::vector<double> brightness_shares(const std::vector<double>& wavelengths,
                                      const std::vector<double>& powers = {});

/// Their sum by shares. @pre equal sizes, one picture a share.
Image mixed(const std::vector<Image>& pictures, const std::vector<double>& shares);

/// The colour of pictures of single wavelengths together, sRGB: white where all of them are 1.
/// Colours that a screen cannot show are clipped. @pre equal sizes, one picture a wavelength.
ColorImage color_picture(const std::vector<Image>& pictures, const std::vector<double>& wavelengths,
                         const std::vector<double>& powers = {});

}  // namespace lensforge
