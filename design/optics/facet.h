// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/compute/host_device.h"
#include "design/optics/image_triangle.h"
#include "design/optics/projection.h"

namespace lensforge {

/// Three surface points, or the derivative of a scalar by them. Millimetres.
struct Corners {
  Eigen::Vector3d v0{0.0, 0.0, 0.0};
  Eigen::Vector3d v1{0.0, 0.0, 0.0};
  Eigen::Vector3d v2{0.0, 0.0, 0.0};
};

/// (v1 − v0) × (v2 − v0): the normal times twice the area (numerator of Sun et al., Eq. 4).
LF_HD inline Eigen::Vector3d area_normal(const Corners& t) {
  return (t.v1 - t.v0).cross(t.v2 - t.v0);
}

/// Twice the signed area of a triangle's projection onto the entry face: the z of area_normal().
LF_HD inline double doubled_projected_area(const Corners& t) {
  return (t.v1.x() - t.v0.x()) * (t.v2.y() - t.v0.y()) -
         (t.v1.y() - t.v0.y()) * (t.v2.x() - t.v0.x());
}

/// Adjoint of area_normal(): adds to the corners' derivatives.
LF_HD inline void area_normal_adjoint(const Corners& t, const Eigen::Vector3d& bar, Corners& grad) {
  const Eigen::Vector3d d1 = (t.v2 - t.v0).cross(bar);
  const Eigen::Vector3d d2 = bar.cross(t.v1 - t.v0);
  grad.v1 += d1;
  grad.v2 += d2;
  grad.v0 -= d1 + d2;
}

/// Adjoint of N ↦ n = N/|N|.
LF_HD inline Eigen::Vector3d normalize_adjoint(const Eigen::Vector3d& n, double length,
                                               const Eigen::Vector3d& n_bar) {
  return (n_bar - n.dot(n_bar) * n) / length;
}

/// Facet model: the whole triangle sends out one parallel beam (Sun et al., section 3.2).
///
/// @param beam  what its unit normal refracts; @param lens_area  mm².
/// @return the image triangle; its flux is the share of the light that the triangle's projection
///         onto the entry face takes (Eq. 1).
LF_HD inline ImageTriangle project_facet(const Corners& t, const RefractedBeam& beam,
                                         const Projection& optics, double lens_area) {
  return {optics.land(t.v0, beam.m), optics.land(t.v1, beam.m), optics.land(t.v2, beam.m),
          0.5 * doubled_projected_area(t) / lens_area};
}

/// Adjoint of project_facet() without the flux: adds to the corners' derivatives directly and
/// returns n_bar, the derivative by the unit normal.
LF_HD inline Eigen::Vector3d project_facet_adjoint(const Corners& t, const Eigen::Vector3d& n,
                                                   const RefractedBeam& beam,
                                                   const Projection& optics,
                                                   const ImageTriangle& bar, Corners& grad) {
  Eigen::Vector2d m_bar(0.0, 0.0);
  optics.land_adjoint(t.v0, beam.m, bar.p0, grad.v0, m_bar);
  optics.land_adjoint(t.v1, beam.m, bar.p1, grad.v1, m_bar);
  optics.land_adjoint(t.v2, beam.m, bar.p2, grad.v2, m_bar);
  return beam.adjoint(n, optics.eta, m_bar);
}

}  // namespace lensforge
