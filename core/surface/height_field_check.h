// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// How far the rim of a surface may be from the rectangle that it should cover, mm.
inline constexpr double kRimTolerance = 0.01;

/// Why a mesh, seen from above, does not cover the rectangle from (0, 0) to `size` exactly once;
/// nothing if it does. A hole of one triangle, a triangle that is given twice, a rim that is
/// not the rectangle's, a vertical triangle or one that is turned over are all found.
///
/// Triangles are joined where their corners have the same coordinates, so that it makes no
/// difference whether vertices are shared. Triangles without any area in space count for nothing.
/// @param size  mm, > 0.
/// @return one clause without the surface's name: "has a hole or an overlap at x 1.20 y 3.40 mm".
/// @pre all vertex numbers are in range.
std::optional<std::string> height_field_fault(const SurfaceMesh& mesh, const Eigen::Vector2d& size);

}  // namespace lensforge
