// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>

namespace lensforge {

/// What a file of meshes says of itself: enough to know it again.
struct MeshContent {
  std::string format;  ///< "3MF" or "glTF 2.0".
  std::string title;   ///< As it is given; may be empty.
  std::int64_t meshes = 0;
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  Eigen::AlignedBox3d box;  ///< Of the meshes as they are stored, mm.
  bool moved = false;       ///< The file moves or turns meshes, which `box` leaves out.
};

/// Reads a 3MF package ("3D Manufacturing Format", core specification 1.3) but for what only
/// printers need. @throw InputError if it is no such package, or holds no mesh.
MeshContent inspect_3mf(const std::filesystem::path& path);

/// Reads the description in a binary glTF file (glTF 2.0); the numbers of its vertices are taken on
/// trust. @throw InputError if it is no such file, or holds no mesh.
MeshContent inspect_glb(const std::filesystem::path& path);

}  // namespace lensforge
