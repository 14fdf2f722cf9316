// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/mesh_normals.h"

namespace lensforge {

Eigen::Matrix3Xd vertex_area_normals(const SurfaceMesh& mesh) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d normal = area_normal(mesh, t);
    for (int k = 0; k < 3; ++k) normals.col(mesh.triangles(k, t)) += normal;
  }
  return normals;
}

}  // namespace lensforge
