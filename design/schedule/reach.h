// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_mesh.h"
#include "design/energy/objective_options.h"
#include "design/energy/picture_terms.h"

namespace lensforge {

/// Gives the mesh the heights that send its light nearest to where `wanted` has it (aim_faces()),
/// its thinnest place `thickness` mm above the entry face.
void aim_surface(const Correspondence& wanted, const OpticalSetup& setup, double thickness,
                 const Executor& executor, SurfaceMesh& mesh);

/// What asks for a surface: the light of a mesh's faces, and where it is to land.
struct Demand {
  const SurfaceMesh& mesh;  ///< Its x and y count.
  const Correspondence& wanted;
  const OpticalSetup& setup;  ///< With the focal length that did not do.
  const Image& target;
  const ObjectiveOptions& objective;
  double thickness = 0.0;  ///< mm
};

/// A focal length, mm, at which the surface that `demand` asks for breaks no barrier: the shortest
/// above that of the setup, within a twentieth; two significant digits. Nothing if there is none up
/// to kMaxFocalLength. Light that has farther to go is bent less, so longer ones do, too.
std::optional<double> reachable_focal_length(const Demand& demand, const Executor& executor);

}  // namespace lensforge
