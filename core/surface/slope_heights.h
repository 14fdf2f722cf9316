// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Least-squares heights of a mesh's vertices, mm, for given slopes: minimises Σ over the edges of
/// (Δz − ½ (s + s')·Δxy)². Edges that end on the border weigh a hundredth, since half of a normal's
/// triangles are missing there. The volume below the mesh is kept.
/// @pre every triangle faces +z. @param slopes  ∂z/∂x, ∂z/∂y at the vertices, 2 × V.
Eigen::VectorXd heights_from_slopes(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& slopes);

}  // namespace lensforge
