// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Points of a smooth surface, the triangles between them, and the surface's own normals there: the
/// normals send the surface's own light, however coarse the triangles.
struct SampledSurface {
  SurfaceMesh mesh;
  Eigen::Matrix3Xd normals;  ///< 3 × V, z > 0, of any length.
};

/// A grid of points still to be filled in, row by row, with its triangles.
SampledSurface make_samples(const GridShape& shape);

}  // namespace lensforge
