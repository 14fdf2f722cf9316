// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/compute/executor.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_mesh.h"
#include "core/surface/surface_model.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// The image triangles of a whole surface under either model, one per mesh triangle, in pixel
/// coordinates. Triangles that reflect the light totally have no flux; of those across the lens's
/// outline the flux is that of the part inside.
/// @pre the mesh's triangle indices are in range.
std::vector<ImageTriangle> project_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                           SurfaceModel model, const Executor& executor);

}  // namespace lensforge
