// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/optics/light_path.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// The light on a surface, its flux as shares of what this surface takes: a higher rim takes in
/// less of a beam that opens, and a picture keeps its total.
LightPath light_on(const SurfaceMesh& mesh, const OpticalSetup& setup);

/// LightPath::intake() of a whole surface, mm².
double intake_of(const SurfaceMesh& mesh, const LightPath& light);

}  // namespace lensforge
