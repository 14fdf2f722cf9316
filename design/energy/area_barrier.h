// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/host_device.h"
#include "core/compute/scalar.h"

namespace lensforge {

/// Thresholds of the area barrier, 0 < lower < upper, in the unit of the areas. All problems that
/// share a mesh must use the same ones, or one's result is outside another's domain.
struct AreaBarrier {
  double lower;  ///< ε1: the projected area of every triangle stays above.
  double upper;  ///< ε2: triangles larger than this are left alone.
};

/// f_area(a) = ((ε2 − ε1)/(a − ε1) − 1)² for ε1 < a < ε2, 0 above, ∞ below (Sun et al., Eq. 8).
LF_HD inline ValueSlope area_barrier(double area, const AreaBarrier& barrier) {
  if (area >= barrier.upper) return {};
  if (!(area > barrier.lower)) return {kInfinity, 0.0};
  const double ratio = (barrier.upper - barrier.lower) / (area - barrier.lower);
  return {(ratio - 1.0) * (ratio - 1.0), -2.0 * (ratio - 1.0) * ratio / (area - barrier.lower)};
}

}  // namespace lensforge
