// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/host_device.h"
#include "design/energy/weingarten.h"

namespace lensforge {

/// E_face of one triangle, H² A (Sun et al., Eq. 15): a pure number, whatever the unit of length.
/// @param area  mm². Adds weight × the derivatives to m_bar and area_bar, returns the value.
LF_HD inline double mean_curvature_term(const WeingartenMap& m, double area, double weight,
                                        WeingartenMap& m_bar, double& area_bar) {
  const double mean = m.mean_curvature();
  m_bar.a += weight * mean * area;
  m_bar.b += weight * mean * area;
  area_bar += weight * mean * mean;
  return mean * mean * area;
}

}  // namespace lensforge
