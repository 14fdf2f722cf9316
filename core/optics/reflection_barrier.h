// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/host_device.h"
#include "core/optics/barrier.h"
#include "core/optics/refraction.h"

namespace lensforge {

/// f_tir = 1/(1 + η²((n·a)² − 1)), ∞ where light is totally reflected (Sun et al., Eq. 9), as a
/// function of c = n·a.
LF_HD inline ValueSlope reflection_barrier(double c, double eta) {
  const double s = refracted_cosine_squared(c, eta);
  if (!(s > 0.0) || !(c > 0.0)) return {kInfinity, 0.0};
  return {1.0 / s, -2.0 * eta * eta * c / (s * s)};
}

}  // namespace lensforge
