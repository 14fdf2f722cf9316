// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "design/optics/image_triangle.h"

namespace lensforge {

/// Facet model: one normal for the whole triangle (Sun et al., section 3.2).
///
/// @param beam  what the facet sends out, LightPath::facet_beam().
/// @param flux  the share of the light that it takes (Eq. 1), LightPath::flux().
LF_HD inline ImageTriangle land_facet(const Corners& t, const FacetBeam& beam,
                                      const LightPath& light, double flux) {
  return {light.land(t.v0, beam.slope(0)), light.land(t.v1, beam.slope(1)),
          light.land(t.v2, beam.slope(2)), flux};
}
LF_HD inline ImageTriangle project_facet(const Corners& t, const FacetBeam& beam,
                                         const LightPath& light) {
  return land_facet(t, beam, light, light.flux(t, beam.known));
}

/// Adjoint of project_facet() without the flux: adds to the corners' derivatives directly and
/// returns n_bar, the derivative by the unit normal.
LF_HD inline Eigen::Vector3d project_facet_adjoint(const Corners& t, const Eigen::Vector3d& n,
                                                   const FacetBeam& beam, const LightPath& light,
                                                   const ImageTriangle& bar, Corners& grad) {
  FacetSlopes m_bar;
  light.land_adjoint(t.v0, beam.slope(0), bar.p0, grad.v0, m_bar.m0);
  light.land_adjoint(t.v1, beam.slope(1), bar.p1, grad.v1, m_bar.m1);
  light.land_adjoint(t.v2, beam.slope(2), bar.p2, grad.v2, m_bar.m2);
  return light.facet_beam_adjoint(t, n, beam, m_bar, grad);
}

}  // namespace lensforge
