// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/optics/optical_setup.h"

namespace lensforge {

/// The setup for light of one wavelength of its spectrum: its index is that of the line d.
OpticalSetup in_color(OpticalSetup setup, double wavelength);

/// A setup in the light of one wavelength, and the share of the brightness that this has.
struct LightColor {
  OpticalSetup setup;
  double share;
};

/// The colours of a setup, from the shortest wavelength, which is bent most; one without a spectrum
/// is its own only colour.
std::vector<LightColor> light_colors(const OpticalSetup& setup);

}  // namespace lensforge
