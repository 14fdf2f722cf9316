// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Wavelength to which most of a setup's brightness is near, mm: the middle one of its spectrum.
/// @param otherwise  mm, for a setup without one.
double middle_wavelength(const OpticalSetup& setup, double otherwise = kMiddleWavelength);

/// mm on the wall: the width of a pixel, or its height if that is less.
double pixel_width(const OpticalSetup& setup);

/// λ f: wavelength × distance from the middle of the lens to the wall, mm².
/// @param z  height of the surface, mm. @param wavelength  mm
double spot_area(const OpticalSetup& setup, double z, double wavelength);

/// √(λ f), mm on the wall: what diffraction blurs.
double diffraction_width(const OpticalSetup& setup, double z, double wavelength);

/// Blurs of the light itself, that no surface escapes: the lamp's image (source_blur()), and
/// √(λ f) for diffraction.
/// @param z  height of the surface, mm. @param wavelength  mm
std::vector<PictureBlur> light_blurs(const OpticalSetup& setup, double z, double wavelength);

/// The widest. @pre not empty.
const PictureBlur& widest(const std::vector<PictureBlur>& blurs);

/// "diffraction blurs 1.0 pixels, polish 0.4, pitch 0.1"; causes below kNoBlur pixels are left out.
std::string blur_words(const std::vector<PictureBlur>& blurs);
inline constexpr double kNoBlur = 0.05;

/// What makes a cause's blur smaller: "a nearer wall".
const char* blur_remedy(const std::string& cause);

/// True unless the image of the lamp is wider than kWideSource times what diffraction blurs: a
/// picture by waves is then that of rays.
/// @param blurs  light_blurs()
bool waves_show(const std::vector<PictureBlur>& blurs);

/// At 3.4 times (the sun through a 25 mm lens at 75 mm) waves add 0.0003 to 0.0011 of MAE.
inline constexpr double kWideSource = 3.0;

/// What lies beyond the sides of a picture that is blurred.
enum class Beyond { kDark, kMirrored };

/// Shares of a pixel's light, even over the pixel, that a Gaussian blur leaves in it and brings 1,
/// 2 … pixels to either side. @param sigma  pixels, ≥ 0.
std::vector<double> gaussian_shares(double sigma);

/// The picture, blurred along rows and columns.
/// @param shares  of a pixel's light that stay and that go 1, 2 … pixels to either side.
Image blurred(const Image& picture, std::span<const double> shares, Beyond beyond);

/// MAE between a picture and the same picture as diffraction and eight bits leave it. The light of
/// a lens whose picture by rays has the error E ends at about √(F² + E²), F this floor: a
/// photograph with deep blacks, 128² on 100 mm at 300 mm, has 0.0038 by waves with E = 0.0015 and
/// 0.0042 with 0.0026.
/// @param z  height of the surface, mm. @param wavelength  mm
double picture_floor(const Image& target, const OpticalSetup& setup, double z, double wavelength);

}  // namespace lensforge
