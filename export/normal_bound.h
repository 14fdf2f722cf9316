// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/surface/smooth_surface.h"

namespace lensforge {

/// How near any surface can come to a vertex-normal model's normals, whatever its knots and
/// patches, even if it breaks along every edge of the mesh.
struct NormalBound {
  double largest = 0.0;  ///< rad: somewhere its normals are off by this at least,
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< in the triangle with this centroid.
  double share_above = 0.0;  ///< Of the area: triangles in which none holds the tolerance.
};

/// Around a triangle the slopes of a surface sum to nothing, ∮ ∇z·dl = 0, so that somewhere on its
/// border |s − ∇z| ≥ |∮ s·dl| / perimeter for the model's slopes s; as an angle, to first order, it
/// is that divided by 1 + |s|². @param tolerance  rad
NormalBound normal_bound(const SmoothSurface& surface, double tolerance);

}  // namespace lensforge
