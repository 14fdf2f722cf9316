// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Gives a mesh the heights of the shape that a design starts from: a flat surface, or behind a
/// curved front the one that makes its light parallel (LightPath::land_from_start()). Its least z
/// is `thickness`, mm. @pre a mesh behind a flat front is flat at that height.
void shape_start(const OpticalSetup& setup, double thickness, const Executor& executor,
                 SurfaceMesh& mesh);

/// That shape on an even grid.
SurfaceMesh start_surface(const OpticalSetup& setup, GridShape grid, double thickness,
                          const Executor& executor);

}  // namespace lensforge
