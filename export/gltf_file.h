// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// A solid for scenes of other programs.
struct GltfPart {
  SurfaceMesh solid;  ///< Closed, mm; the optical surface's triangles first (closed_solid()).
  Eigen::Matrix3Xd normals;  ///< Of the optical surface at its vertices, the solid's first ones.
  std::int64_t surface_triangles = 0;
  /// How many triangles at the solid's end are a curved face, which is shaded smoothly.
  std::int64_t curved_back = 0;
  double ior = 1.49;    ///< Of a lens.
  bool mirror = false;  ///< Polished metal instead of clear glass.
};

/// Writes binary glTF 2.0 in metres: x, y and z are the lens frame's, so that the picture's up is
/// glTF's. A lens is clear by KHR_materials_transmission, KHR_materials_volume and
/// KHR_materials_ior. Walls and a flat back have normals of their own. The file appears whole or
/// not at all. @throw RunError if it cannot be written, or would be longer than 4 GiB.
void write_glb(const GltfPart& part, const std::string& title, const std::filesystem::path& path);

}  // namespace lensforge
