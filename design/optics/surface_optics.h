// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/compute/executor.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_mesh.h"
#include "design/optics/image_triangle.h"

namespace lensforge {

/// Sum of the area normals of the triangles around every vertex, 3 × V, mm²·2: its direction is the
/// vertex normal of the smooth model.
Eigen::Matrix3Xd vertex_area_normals(const SurfaceMesh& mesh);

/// The image triangles of a whole surface under either model, one per mesh triangle, in pixel
/// coordinates. Triangles that reflect the light totally have no flux.
/// @pre the mesh's triangle indices are in range.
std::vector<ImageTriangle> project_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                           SurfaceModel model, const Executor& executor);

}  // namespace lensforge
