// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Heights of a mesh's vertices, mm, that agree best with given slopes: Σ over the edges of
/// (Δz − ½ (s + s')·Δxy)² is least, where edges that end on the border weigh a hundredth: half of
/// what makes a normal is missing there. The volume below the mesh stays.
/// @pre every triangle faces +z. @param slopes  ∂z/∂x, ∂z/∂y at the vertices, 2 × V.
Eigen::VectorXd heights_from_slopes(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& slopes);

}  // namespace lensforge
