// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// A triangle's normal times twice its area, mm².
inline Eigen::Vector3d area_normal(const SurfaceMesh& mesh, std::int64_t triangle) {
  return area_normal(mesh.corners(triangle));
}

/// The sum of the area normals around every vertex, 3 × V, mm²: the vertex normals of the smooth
/// model before they are normalised.
Eigen::Matrix3Xd vertex_area_normals(const SurfaceMesh& mesh);

}  // namespace lensforge
