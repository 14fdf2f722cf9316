// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/optics/light_path.h"
#include "core/surface/mesh_cut.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// The light on a surface, with flux as a share of this surface's intake: a higher rim takes in
/// less of a diverging beam, but the picture keeps its total.
/// @pre the mesh has no triangles outside setup.outline.
LightPath light_on(const SurfaceMesh& mesh, const OpticalSetup& setup);

/// The same for a mesh that extends beyond the outline.
LightPath light_inside(const SurfaceMesh& mesh, const MeshCut& cut, const OpticalSetup& setup);

/// LightPath::intake() of the part of a mesh inside an outline, mm².
double intake_inside(const SurfaceMesh& mesh, const MeshCut& cut, const LightPath& light);

/// LightPath::intake() of a whole surface, mm².
double intake_of(const SurfaceMesh& mesh, const LightPath& light);

/// Maximum distance beyond the lens's edges at which a vertex's light enters a curved front, mm; 0
/// for a flat front.
double overhang(const SurfaceMesh& mesh, const OpticalSetup& setup);

}  // namespace lensforge
