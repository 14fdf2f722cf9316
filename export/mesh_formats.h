// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "core/surface/surface_mesh.h"

/// Meshes in the formats that printers, CAM programs and viewers read; millimetres. Each file
/// appears whole or not at all, and shows its title to one who looks at its bytes. PLY and
/// STL are core/surface/mesh_io.h's.
namespace lensforge {

/// Wavefront OBJ; coordinates read back as the same doubles. `title` becomes a comment.
/// @throw RunError if it cannot be written.
void write_obj(const SurfaceMesh& mesh, const std::string& title,
               const std::filesystem::path& path);

/// 3MF core specification 1.2: one object, unit millimetre, coordinates to 1e-9 mm; `title` of
/// 65,535 bytes at most.
/// @pre the mesh is closed. @throw RunError if it cannot be written.
void write_3mf(const SurfaceMesh& mesh, const std::string& title,
               const std::filesystem::path& path);

}  // namespace lensforge
