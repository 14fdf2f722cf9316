// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/optics/optical_setup.h"

namespace lensforge {

/// The setup for light of one wavelength; setup.ior is taken as the index at the d line.
OpticalSetup in_color(OpticalSetup setup, double wavelength);

/// The setup for one wavelength, and that wavelength's share of the brightness.
struct LightColor {
  OpticalSetup setup;
  double share;
};

/// The colours of a setup, shortest wavelength (bent most) first. A setup without a spectrum has
/// one colour: itself.
std::vector<LightColor> light_colors(const OpticalSetup& setup);

}  // namespace lensforge
