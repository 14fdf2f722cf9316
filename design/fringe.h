// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/lens/lens.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// How far apart on the screen the first and last wavelength of the spectrum land, mm.
struct Fringe {
  double mean = 0.0;  ///< Over the vertices of the surface.
  double max = 0.0;
};

/// @param normals  3 × V of the surface at its vertices, of any length, z > 0. Rays that do not
///                 leave the surface are left out. @pre the setup has a spectrum.
Fringe fringe_of(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                 const OpticalSetup& setup);

/// The same of a lens under its own model.
Fringe fringe_of(const Lens& lens);

}  // namespace lensforge
