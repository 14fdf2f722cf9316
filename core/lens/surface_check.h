// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"

namespace lensforge {

/// Maximum distance of the surface's rim from the lens's, share of the lens's longer side: a design
/// keeps its rim to double precision, other programs to single (6e-8).
inline constexpr double kRimShare = 1e-4;

/// Returns why a mesh cannot be the optical surface of a lens with this setup: a triangle that does
/// not face +z, heights not between the entry face and the receiving plane, an extent other than
/// the lens's. One clause without the surface's name; nothing if it can.
std::optional<std::string> surface_fault(const SurfaceMesh& mesh, const OpticalSetup& setup);

/// Returns why a spline cannot be the optical surface of a lens with this setup: its rim is not the
/// lens's rectangle to the last bit, or surface_fault() of its nodes. One clause; nothing if it can
/// be.
std::optional<std::string> spline_fault(const ControlNet& net, const OpticalSetup& setup);

/// Returns why the triangles of a mesh are not those of a grid of this shape, two per cell: a whole
/// clause; nothing if they are. @pre as many vertices as the shape says.
std::optional<std::string> grid_fault(const SurfaceMesh& mesh, const GridShape& shape);

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
