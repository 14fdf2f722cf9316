// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"

namespace lensforge {

/// The vertices around a surface's outline, counter-clockwise seen from +z, each once.
/// @param name  the surface's name in the error.
/// @throw InputError unless the surface is a height field in one piece without holes above z = 0:
///        every triangle faces +z, and the outline crosses itself nowhere (polygon_fault()).
std::vector<int> height_field_outline(const SurfaceMesh& surface, const std::string& name);

/// @throw InputError unless every vertex of the outline lies on the rectangle around the surface.
void require_rectangle(const SurfaceMesh& surface, const std::vector<int>& outline,
                       const std::string& name);

/// The watertight solid between a surface and the plane z = 0, or a curved front: the surface's own
/// triangles first, then walls, then the back; all of them face outwards. A curved back, or the
/// back of an outline that is not star-shaped about its middle, has the surface's vertices in x and
/// y.
/// @throw InputError as height_field_outline(), or if the surface reaches down to the front.
SurfaceMesh closed_solid(const SurfaceMesh& surface, const std::string& name,
                         const std::optional<Front>& front = {});

/// Volume enclosed by a closed mesh whose triangles face outwards, mm³.
double enclosed_volume(const SurfaceMesh& solid);

}  // namespace lensforge
