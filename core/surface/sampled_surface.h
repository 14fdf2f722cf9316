// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Points of a smooth surface, the triangles between them, and the surface's own normals there:
/// the light that the normals send is what the surface sends, however coarse the triangles.
struct SampledSurface {
  SurfaceMesh mesh;
  Eigen::Matrix3Xd normals;  ///< 3 × V, z > 0, of any length.
};

/// A grid of points that are still to be filled in, row by row, and the triangles between them.
SampledSurface make_samples(const GridShape& shape);

}  // namespace lensforge
