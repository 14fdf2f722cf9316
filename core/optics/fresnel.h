// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "core/compute/host_device.h"
#include "core/optics/refraction.h"
#include "core/value_slope.h"

namespace lensforge {

/// Share of unpolarised light that goes through a face between a medium of index η and air, by
/// Fresnel's formulas, and its derivative by c, the cosine of the angle to the normal on the
/// medium's side. The face is uncoated; both directions have the same share. 0 at total internal
/// reflection.
LF_HD inline ValueSlope transmittance(double c, double eta) {
  const double s = refracted_cosine_squared(c, eta);
  if (!(c > 0.0) || !(s > 0.0)) return {0.0, 0.0};
  const double t = std::sqrt(s);
  const double across = eta * c + t;
  const double along = c + eta * t;
  const double r_across = (eta * c - t) / across;
  const double r_along = (c - eta * t) / along;
  // ∂t/∂c = η²c/t; both amplitudes have the numerator 2η(t − c ∂t/∂c) over their sum squared.
  const double numerator = 2.0 * eta * (t - eta * eta * c * c / t);
  const double slope = numerator * (r_across / (across * across) + r_along / (along * along));
  return {1.0 - 0.5 * (r_across * r_across + r_along * r_along), -slope};
}

/// Share of light at normal incidence that is reflected by both faces of a lens and then leaves
/// with the rest. It spreads over the picture and its surroundings: if all of it fell evenly on the
/// picture, no pixel would be darker than this share of the mean.
inline double ghost_share(double eta) {
  const double reflected = 1.0 - transmittance(1.0, eta).value;
  return reflected * reflected;
}

}  // namespace lensforge
