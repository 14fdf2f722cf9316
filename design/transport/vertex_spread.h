// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// What part of the image rectangle the light of every face of a mesh serves.
struct ServedAreas {
  const SurfaceMesh& mesh;
  const Eigen::VectorXd& areas;  ///< F values, in any unit.
};

/// The served areas with those of dark parts weighed more, by brightness^−p, so that a dark pixel
/// gets more facets: a facet projects its own shape, which in the dark covers a small part of a
/// pixel only, and one facet too few leaves the pixel unlit. p is kDarkPower, or less where more
/// than kDarkCost of the other facets would be taken away: a picture that is dark all over has none
/// to spare. Facets, MAE in thousandths after six rounds without and with it: 256 × 128
/// calligraphy 4.3 and 2.9, 128² portrait 2.9 and 2.5; 64² city and 96² logo no change.
/// @return F values in the unit of served.areas; 0 where that is 0.
Eigen::VectorXd favour_dark(const ServedAreas& served, const OpticalSetup& setup);

/// Moves the vertices of an even grid mesh so that they follow the picture, not the lens. Light of
/// uniform density leaves hardly any lens area to the dark parts of a picture: a dark pixel gets a
/// fraction of one facet of an even mesh, and shows as dots (facet model) or as the streak of a
/// stretched triangle (smooth model). Afterwards a share of the facets is spread evenly over the
/// picture, dark or bright.
///
/// The density of vertices on the lens, (1 − share) + share × (image area per lens area), is
/// brought about by a transport map from the even grid (solve_monge_ampere()). Every triangle keeps
/// its orientation: where the density jumps so that some would not, it is smoothed first; if that
/// is of no use, the mesh stays.
/// @param served  of an even mesh over the same lens, which may be another and coarser one.
/// @param share  0 … 0.95.
/// @return false if the caller asked to stop; the mesh is then unchanged.
bool spread_vertices(const ServedAreas& served, double share, const OpticalSetup& setup,
                     const Executor& executor, const RunControl& control, SurfaceMesh& mesh);

}  // namespace lensforge
