// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// A setup for a mesh that comes alone: the image rectangle lies straight above the lens and is as
/// large, the working picture has 256 pixels on its longer side.
OpticalSetup setup_for_mesh(const SurfaceMesh& mesh);

/// The same setup with `pixels` on the longer side of the picture.
OpticalSetup with_longer_side(OpticalSetup setup, int pixels);

/// The same setup with an image rectangle of this width, proportions and centre kept.
OpticalSetup with_image_width(OpticalSetup setup, double width);

/// @throw InputError unless the wall lies above the whole surface and the setup is valid.
void require_wall_above(const SurfaceMesh& mesh, const OpticalSetup& setup);

}  // namespace lensforge
