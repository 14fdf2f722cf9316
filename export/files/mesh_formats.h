// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/mesh/surface_mesh.h"

/// Meshes in the formats that printers, CAM programs and viewers read; millimetres. A new format is
/// a row of mesh_formats(). Each file
/// appears whole or not at all and contains its title as plain text. PLY and STL are in
/// core/mesh/mesh_files.h.
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

/// A lens as a closed mesh, with its looks for scenes in other programs.
struct ClosedMesh {
  SurfaceMesh solid;         ///< mm; the optical surface's triangles first (closed_solid()).
  Eigen::Matrix3Xd normals;  ///< At the optical surface's vertices, which come first in the solid.
  std::int64_t surface_triangles = 0;
  /// Number of triangles at the solid's end that form a curved back, which is shaded smoothly.
  std::int64_t curved_back = 0;
  double ior = 1.49;    ///< Lenses only.
  bool mirror = false;  ///< Polished metal instead of clear glass.
};

/// Writes binary glTF 2.0 in metres: x, y and z are the lens frame's, so that the picture's up is
/// glTF's. A lens is clear by KHR_materials_transmission, KHR_materials_volume and
/// KHR_materials_ior. Walls and a flat back are shaded flat, with their own normals. The file
/// appears whole or not at all. @throw RunError if it cannot be written, or would be longer than 4
/// GiB.
void write_glb(const ClosedMesh& part, const std::string& title, const std::filesystem::path& path);

/// Summary of a file of meshes, enough to identify it.
struct MeshContent {
  std::string format;  ///< "3MF" or "glTF 2.0".
  std::string title;   ///< As in the file; may be empty.
  std::int64_t meshes = 0;
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  Eigen::AlignedBox3d box;  ///< Of the meshes as they are stored, mm.
  bool moved = false;       ///< The file moves or turns meshes; `box` ignores that.
};

/// Reads a 3MF package ("3D Manufacturing Format", core specification 1.3) except for data that
/// only printers need. @throw InputError if it is no such package, or holds no mesh.
MeshContent inspect_3mf(const std::filesystem::path& path);

/// Reads the description in a binary glTF file (glTF 2.0); its vertex data are not checked. @throw
/// InputError if it is no such file, or holds no mesh.
MeshContent inspect_glb(const std::filesystem::path& path);

/// A file format for closed meshes.
struct MeshFormat {
  const char* word;  ///< For --format; also its extension.
  const char* note;  ///< For the help, in brackets; may be empty.
  void (*write)(const ClosedMesh& mesh, const std::string& title,
                const std::filesystem::path& path);
  /// Summary of a file; null if read_mesh() reads the format.
  MeshContent (*inspect)(const std::filesystem::path& path);
};

std::span<const MeshFormat> mesh_formats();

}  // namespace lensforge
