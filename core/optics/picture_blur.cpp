// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/picture_blur.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/optics/light_path.h"
#include "core/optics/light_source.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {

double middle_wavelength(const OpticalSetup& setup, double otherwise) {
  const std::vector<double>& all = setup.spectrum.wavelengths;
  return all.empty() ? otherwise : kMmPerNm * all[all.size() / 2];
}

double pixel_width(const OpticalSetup& setup) {
  return setup.image_size.cwiseQuotient(setup.pixels.cast<double>()).minCoeff();
}

double spot_area(const OpticalSetup& setup, double z, double wavelength) {
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), z);
  return wavelength * LightPath(setup).clearance(middle);
}

double diffraction_width(const OpticalSetup& setup, double z, double wavelength) {
  return std::sqrt(spot_area(setup, z, wavelength));
}

std::vector<PictureBlur> light_blurs(const OpticalSetup& setup, double z, double wavelength) {
  const double diffraction = diffraction_width(setup, z, wavelength) / pixel_width(setup);
  return {{"lamp", source_blur(setup, z)}, {"diffraction", diffraction}};
}

const PictureBlur& widest(const std::vector<PictureBlur>& blurs) {
  return *std::max_element(
      blurs.begin(), blurs.end(),
      [](const PictureBlur& a, const PictureBlur& b) { return a.pixels < b.pixels; });
}

std::string blur_words(const std::vector<PictureBlur>& blurs) {
  std::string text;
  for (const PictureBlur& blur : blurs) {
    if (blur.pixels < kNoBlur) continue;
    const std::string width = decimal_text(blur.pixels, 1);
    text += joined({text.empty() ? "" : ", ", blur.cause, text.empty() ? " blurs " : " ", width,
                    text.empty() ? " pixels" : ""});
  }
  return text.empty() ? "nothing blurs the picture" : text;
}

const char* blur_remedy(const std::string& cause) {
  if (cause == "lamp") return "a smaller or farther lamp, or a nearer wall";
  if (cause == "diffraction") return "a nearer wall";
  if (cause == "polish") return "less polish, or a larger lens";
  return "closer rows, or a larger ball";
}

bool waves_show(const std::vector<PictureBlur>& blurs) {
  return blurs[0].pixels <= kWideSource * blurs[1].pixels;
}

}  // namespace lensforge
