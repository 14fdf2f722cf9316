// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// A mesh of about `faces` even triangles over the same surface, by CGAL's isotropic remeshing
/// (Botsch & Kobbelt 2004). Creases of more than 50° and boundaries stay where they are.
/// @return within 10 % of `faces` on smooth shapes; creases take whole edges. @pre as repair_mesh()
/// returns it
/// @throw InputError naming --faces if CGAL cannot take the mesh.
SurfaceMesh remeshed(const SurfaceMesh& mesh, int faces);

}  // namespace lensforge::reflect
