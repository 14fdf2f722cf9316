// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/height_field.h"

#include <cmath>
#include <cstdint>
#include <string>

#include "core/decimal_text.h"
#include "core/error.h"

namespace lensforge {
namespace {

std::string millimetres(double value) { return decimal_text(value, 4); }

void require_finite(const SurfaceMesh& mesh) {
  if (mesh.triangle_count() == 0) throw InputError("surface: has no triangles");
  if (!mesh.vertices.allFinite()) throw InputError("surface: has a vertex that is not finite");
}

void require_box(const Eigen::AlignedBox3d& box, const Eigen::Vector2d& size) {
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(box.min()[axis]) <= kRimTolerance &&
        std::abs(box.max()[axis] - size[axis]) <= kRimTolerance) {
      continue;
    }
    throw InputError("surface: spans " + std::string(axis == 0 ? "x " : "y ") +
                     millimetres(box.min()[axis]) + " to " + millimetres(box.max()[axis]) +
                     " mm, not 0 to " + millimetres(size[axis]) + " mm as the lens does");
  }
}

}  // namespace

HeightField inspect_height_field(const SurfaceMesh& mesh, const Eigen::Vector2d& size) {
  require_finite(mesh);
  HeightField field;
  double area = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 0);
    const Eigen::Vector3d b = mesh.corner(t, 1);
    const Eigen::Vector3d c = mesh.corner(t, 2);
    for (const Eigen::Vector3d& corner : {a, b, c}) field.box.extend(corner);
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.isZero(0.0)) continue;
    if (!(normal.z() > 0.0)) {
      throw InputError("surface: is no height field, triangle " + std::to_string(t) +
                       " is vertical or turned over");
    }
    area += 0.5 * normal.z();
    const double slope = normal.head<2>().norm() / normal.z();
    if (slope > field.steepest) {
      field.steepest = slope;
      field.steepest_place = (a + b + c) / 3.0;
    }
  }
  require_box(field.box, size);
  const double slack = 2.0 * kRimTolerance * size.sum();
  if (std::abs(area - size.prod()) > slack) {
    throw InputError("surface: is no height field over the lens, its triangles cover " +
                     millimetres(area) + " of " + millimetres(size.prod()) + " mm2");
  }
  return field;
}

}  // namespace lensforge
