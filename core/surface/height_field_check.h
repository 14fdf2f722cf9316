// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Maximum distance of a surface's rim from the rectangle that it should cover, mm.
inline constexpr double kRimDistance = 0.01;

/// Checks that a mesh, seen from above, covers the rectangle from (0, 0) to `size` exactly once. It
/// finds a hole of one triangle, a duplicate triangle, a rim that is not the rectangle's, and a
/// vertical or inverted triangle.
///
/// Triangles are joined where corners have equal coordinates, so vertices need not be shared.
/// Triangles of zero area in space are ignored.
/// @param size  mm, > 0.
/// @return nothing, or one clause without the surface's name: "has a hole or an overlap at x 1.20 y
///         3.40 mm".
/// @pre all vertex numbers are in range.
std::optional<std::string> height_field_fault(const SurfaceMesh& mesh, const Eigen::Vector2d& size);

}  // namespace lensforge
