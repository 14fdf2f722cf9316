// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "core/optics/optical_setup.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Maximum distance of the surface's rim from the lens's, share of the lens's longer side: a design
/// keeps its rim to double precision, other programs to single (6e-8).
inline constexpr double kRimShare = 1e-4;

/// Returns why a mesh cannot be the optical surface of a lens with this setup: a triangle that does
/// not face +z, heights not between the entry face and the receiving plane, an extent other than
/// the lens's. One clause without the surface's name; nothing if it can.
std::optional<std::string> surface_fault(const SurfaceMesh& mesh, const OpticalSetup& setup);

/// Returns why the triangles of a mesh are not those of a grid of this shape, two per cell: a whole
/// clause; nothing if they are. @pre as many vertices as the shape says.
std::optional<std::string> grid_fault(const SurfaceMesh& mesh, const GridShape& shape);

}  // namespace lensforge
