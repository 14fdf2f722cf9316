// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/dispersion.h"

namespace lensforge {
namespace {

/// Fraunhofer's lines, nm.
constexpr double kLineF = 486.13;
constexpr double kLineD = 587.56;
constexpr double kLineC = 656.27;

constexpr double inverse_square(double x) { return 1.0 / (x * x); }

}  // namespace

double Dispersion::index_at(double wavelength) const {
  const double b = (n_d - 1.0) / (abbe * (inverse_square(kLineF) - inverse_square(kLineC)));
  return n_d + b * (inverse_square(wavelength) - inverse_square(kLineD));
}

}  // namespace lensforge
