// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/optics/light_path.h"
#include "core/surface/mesh_cut.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// The light on a surface, its flux as shares of what this surface takes: a higher rim takes in
/// less of a beam that opens, and a picture keeps its total.
/// @pre the mesh has no triangles outside of setup.outline.
LightPath light_on(const SurfaceMesh& mesh, const OpticalSetup& setup);

/// The same where a mesh goes on beyond the outline.
LightPath light_inside(const SurfaceMesh& mesh, const MeshCut& cut, const OpticalSetup& setup);

/// LightPath::intake() of the parts of a mesh inside of an outline, mm².
double intake_inside(const SurfaceMesh& mesh, const MeshCut& cut, const LightPath& light);

/// LightPath::intake() of a whole surface, mm².
double intake_of(const SurfaceMesh& mesh, const LightPath& light);

/// How far beyond the lens's edges light enters a curved front that comes to a vertex, mm, at most;
/// 0 behind a flat one.
double overhang(const SurfaceMesh& mesh, const OpticalSetup& setup);

}  // namespace lensforge
