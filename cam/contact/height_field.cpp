// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/height_field.h"

#include <cstdint>

#include "core/error.h"
#include "core/surface/mesh_normals.h"

namespace lensforge {

HeightField inspect_height_field(const SurfaceMesh& mesh, const Eigen::Vector2d& size) {
  if (const auto fault = height_field_fault(mesh, size)) throw InputError("surface: " + *fault);
  HeightField field;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 0);
    const Eigen::Vector3d b = mesh.corner(t, 1);
    const Eigen::Vector3d c = mesh.corner(t, 2);
    for (const Eigen::Vector3d& corner : {a, b, c}) field.box.extend(corner);
    const Eigen::Vector3d normal = area_normal(mesh, t);
    if (normal.isZero(0.0)) continue;
    const double slope = normal.head<2>().norm() / normal.z();
    if (slope > field.steepest) {
      field.steepest = slope;
      field.steepest_place = (a + b + c) / 3.0;
    }
  }
  return field;
}

}  // namespace lensforge
