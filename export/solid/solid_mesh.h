// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "core/compute/run_control.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// How far triangles of read_solid_mesh() may be from the faces, share of the diagonal of the
/// bounding box.
inline constexpr double kSolidDeflection = 1e-3;
/// And how far their normals turn from one to the next, rad.
inline constexpr double kSolidTurn = 0.2;

/// The triangles of all solids and shells of a STEP file, outwards as its faces look; faces that
/// share an edge share its vertices. Lengths become millimetres.
/// @throw InputError naming the file if it cannot be read or holds no faces, or if one of them
///        cannot be tessellated; Interrupted. OpenCASCADE works in a child process: what makes it
///        crash is an InputError as well.
SurfaceMesh read_solid_mesh(const std::filesystem::path& path, const RunControl& control = {});

}  // namespace lensforge
