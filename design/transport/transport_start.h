// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/image.h"
#include "core/optical_setup.h"
#include "core/run_control.h"
#include "core/surface_mesh.h"

namespace lensforge {

/// Gives a mesh the heights that send light where the transport map of `picture` wants it, the
/// start of rendering-guided optimisation: it moves light over long distances, which descent on
/// picture errors cannot (Sun et al., Fig. 10, first column).
///
/// The map is continuous (solve_monge_ampere()); refraction is inverted for the slope that each ray
/// needs and the slopes are integrated in the least-squares sense, a Poisson problem. x and y stay.
/// @pre the lens's outline equals the image rectangle; picture has setup.pixels.
/// @return false if the caller asked to stop; the mesh is then unchanged.
bool start_from_transport(const Image& picture, const OpticalSetup& setup,
                          const RunControl& control, SurfaceMesh& mesh);

}  // namespace lensforge
