// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// The field that a parabolic cylinder of perfect conductor sends straight back from its vertex, as
/// a share of what physical optics and geometrical optics give, which agree there: the exact
/// solution of H. Lamb, "On Sommerfeld's diffraction problem; and on reflection by a parabolic
/// mirror", Proc. London Math. Soc. s2-4, 190-203, 1907. With w = −2iτ e^{−iτ²} ∫_τ^∞ e^{iu²} du
/// and τ² = kρ it is 1/w for an electric field along the cylinder and 1/(2 − w) across. Both go to
/// 1 for large kρ; for ρ = 0 they are the edge of a half-plane.
/// @param k_rho  wave number times radius of curvature at the vertex, > 0.
struct ParabolicShares {
  std::complex<double> along;
  std::complex<double> across;
};
ParabolicShares parabolic_shares(double k_rho);

/// How much more or less than physical optics a face of a curved surface sends back: 1 for a flat
/// one, for a cylinder the share of the parabolic one with its radius, seen from outside. For two
/// curvatures the shares are multiplied.
struct CurvedFace {
  Eigen::Vector3d along;       ///< Unit; direction of one principal curvature.
  std::complex<double> share;  ///< For the electric field in this direction.
  std::complex<double> other;  ///< For the electric field across.

  /// The share of the field sent and received with this polarization; n is the face's normal.
  [[nodiscard]] std::complex<double> of(const Eigen::Vector3d& polarization,
                                        const Eigen::Vector3d& n) const;
};

/// Of every face of a mesh, by the turns of the normals at its corners (Rusinkiewicz 2004). Faces
/// are flat where they are concave, and where they touch one of these vertices.
/// @param creased  a flag per vertex, set where the surface is not smooth.
std::vector<CurvedFace> curved_faces(const SurfaceMesh& mesh, const std::vector<bool>& creased,
                                     double wavelength);

}  // namespace lensforge::reflect
