// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {

/// A face of a wedge, as long as wanted.
struct WedgeFace {
  Eigen::Vector3d out;     ///< Unit; in the face, from the edge and perpendicular to it.
  Eigen::Vector3d normal;  ///< Unit; away from the material.
};

/// A straight edge of a perfectly conducting body.
struct RadarEdge {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  std::array<WedgeFace, 2> faces;
  double open = 2.0;  ///< Angle outside of the material in units of π: 2 for the rim of a sheet.
  std::array<int, 2> vertices{};  ///< Of the mesh: its ends.
};

/// The field that an edge adds to physical optics, per length of edge and for monostatic radar: the
/// sum of physical optics, Σ (n·ω) ∫ e^{−2ikω·r} dA, grows by (i/k) f ∫ e^{−2ikω·r} dl with this f.
///
/// It is the far field of the fringe current on both faces, the exact current of the wedge
/// (Sommerfeld's series) without that of physical optics, integrated from the edge along the
/// diffracted ray that grazes the face, as in A. Michaeli, "Elimination of infinities in equivalent
/// edge currents, part I: fringe current components", IEEE Trans. Antennas Propag. 34(7), 1986.
/// This is the contribution of Ufimtsev's elementary edge waves and, up to the direction in which
/// the current is integrated, of Mitzner's incremental length diffraction coefficients.
/// @param towards       unit vector to the radar.
/// @param polarization  unit vector of the electric field sent and received, perpendicular to it.
/// @return 0 for directions inside the material, and along the edge.
double edge_fringe(const RadarEdge& edge, const Eigen::Vector3d& towards,
                   const Eigen::Vector3d& polarization);

/// The edges of a mesh that radar sees as such: boundaries, and convex edges whose faces turn by
/// more than λ/(2 h), where h is the mean height of both faces above the edge, or by more than 40°.
/// Faces that turn by less follow a smooth surface to λ/16, which is why their edges are none.
/// Concave edges add nothing of first order beside the light of two bounces.
/// @pre vertices in the same place are merged.
std::vector<RadarEdge> radar_edges(const SurfaceMesh& mesh, double wavelength);

}  // namespace lensforge::reflect
