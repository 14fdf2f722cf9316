// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/surface/height_field_check.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Size and steepness of a surface that was found to be a height field.
struct HeightField {
  Eigen::AlignedBox3d box;         ///< Of all triangles, mm.
  double steepest = 0.0;           ///< Largest slope, rise over run.
  Eigen::Vector3d steepest_place;  ///< Centre of that triangle, mm.
};

/// Looks over a surface that is to be cut from above.
/// @param size  of the rectangle from (0, 0) that it has to cover, mm.
/// @throw InputError if it has no triangles, has coordinates that are not finite, or does not cover
///        the rectangle exactly once (height_field_fault()).
HeightField inspect_height_field(const SurfaceMesh& mesh, const Eigen::Vector2d& size);

}  // namespace lensforge
