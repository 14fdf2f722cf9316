// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/mesh/surface_mesh.h"
#include "design/schedule/design_task.h"
#include "design/schedule/guided_optimization.h"

namespace lensforge {

/// What a level begins with: the surface of the one before on its own grid. A mesh has no folded
/// and no tiny triangles (even_out()). A spline's knot lines follow the vertices as far as no
/// barrier refuses it. @throw Interrupted
SurfaceMesh level_start(const DesignTask& task, const Level& level, const SurfaceMesh& mesh);

/// Draws the first `coordinates` of x, y and z towards another surface on the same grid, no farther
/// than it needs until no barrier refuses the mesh. @return false if one still does.
bool draw_towards(const SurfaceMesh& other, int coordinates, GuidedOptimization& stage,
                  SurfaceMesh& mesh);

}  // namespace lensforge
