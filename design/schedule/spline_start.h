// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"

namespace lensforge {

/// Control points that follow a mesh as a grid mesh of their own, for which the stages of a design
/// are made.
SurfaceMesh net_mesh(const ControlNet& net);

/// The spline nearest to what a grid mesh projects by its vertex normals: its knot lines follow
/// the vertices, its slopes theirs (SlopeFit).
/// @param size   of the lens, mm. @param shape  control points each way, ≥ 4.
/// @param share  of the vertices' movement that the knot lines take part in, 0 … 1.
/// @throw Interrupted.
ControlNet spline_through(const SurfaceMesh& mesh, const Eigen::Vector2d& size,
                          const GridShape& shape, double share, const Executor& executor,
                          const RunControl& control);

/// The net on coordinates that a file of a solid writes in few digits: x and y of inner points on
/// whole 1e-7 mm, heights on whole 1e-9 mm, which turns normals by up to 1e-6 rad where knots are
/// densest. Lifted so that the lowest node is `thickness` above the entry face.
ControlNet settled(ControlNet net, double thickness);

}  // namespace lensforge
