// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Reads PLY, OBJ, STL or OFF, chosen by the extension. STL corners that coincide are merged, other
/// polygons cut into triangles.
/// @throw InputError naming the file if it is missing, no regular file, corrupt, empty, has a face
///        of fewer than three corners, an index out of range or a coordinate that is not finite.
SurfaceMesh read_mesh(const std::filesystem::path& path);

/// Writes binary little-endian PLY, `double x y z` and `uchar`/`int` triangle list; whole or not at
/// all. @throw RunError if it cannot be written.
void write_ply(const SurfaceMesh& mesh, const std::filesystem::path& path);

/// The same with unit normals, `double nx ny nz`. @param normals  3 × V, of any length but 0.
void write_ply(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
               const std::filesystem::path& path);

/// Writes binary STL; coordinates are rounded to 32-bit floats (4e-6 mm at 100 mm). The file
/// appears whole or not at all, and begins with its title. @throw RunError if it cannot be written.
void write_stl(const SurfaceMesh& mesh, const std::string& title,
               const std::filesystem::path& path);

}  // namespace lensforge
