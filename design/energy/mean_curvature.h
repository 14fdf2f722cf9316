// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/host_device.h"
#include "core/compute/scalar.h"
#include "design/energy/weingarten.h"

namespace lensforge {

/// E_face of one triangle, H² A (Sun et al., Eq. 15), and its slope by the area: a pure number,
/// whatever the unit of length. @param area  mm²
LF_HD inline ValueSlope mean_curvature_term(const WeingartenMap& m, double area) {
  const double squared = m.mean_curvature() * m.mean_curvature();
  return {squared * area, squared};
}

}  // namespace lensforge
