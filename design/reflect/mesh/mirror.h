// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// The mirror image of every vertex at the middle of the bounding box across an axis (0: x).
/// @throw InputError naming --symmetry and a vertex without one: vertices must match within 1e-4 of
///        the box's diagonal.
std::vector<int> mirror_partners(const SurfaceMesh& mesh, int axis);

}  // namespace lensforge::reflect
