// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/milled/surface_field.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// The sampled surface as a mesh that is laid out as a grid: two triangles between four nodes.
SurfaceMesh mesh_of(const SurfacePatch& patch);

}  // namespace lensforge
