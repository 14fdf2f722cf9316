// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_colors.h"

#include <cstddef>

#include "core/optics/dispersion.h"

namespace lensforge {

OpticalSetup in_color(OpticalSetup setup, double wavelength) {
  setup.ior = Dispersion{setup.ior, setup.spectrum.abbe}.index_at(wavelength);
  setup.spectrum = {};
  return setup;
}

std::vector<LightColor> light_colors(const OpticalSetup& setup) {
  if (setup.spectrum.none()) return {{setup, 1.0}};
  const std::vector<double> shares = setup.spectrum.shares();
  std::vector<LightColor> colors;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    colors.push_back({in_color(setup, setup.spectrum.wavelengths[k]), shares[k]});
  }
  return colors;
}

}  // namespace lensforge
