// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/mesh/surface_mesh.h"
#include "design/random_input.h"

namespace lensforge::testing {

/// A flat mesh whose cells are two and a half times as wide on one side as on the other, and whose
/// inner vertices are displaced at random by up to `jitter` cells.
inline SurfaceMesh graded_mesh(const Eigen::Vector2d& size, const GridShape& shape, double jitter,
                               std::uint64_t seed) {
  Random random(seed);
  SurfaceMesh mesh = make_grid_mesh(size, shape, 5.0);
  const Eigen::Vector2d cell =
      size.cwiseQuotient(Eigen::Vector2d(shape.columns - 1, shape.rows - 1));
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector2d shift = jitter * cell.cwiseProduct(random.vector2());
    for (int k = 0; k < 2; ++k) {
      double& x = mesh.vertices(k, v);
      if (x <= 0.0 || x >= size[k]) continue;
      x += shift[k] + 0.43 * size[k] / std::numbers::pi * std::sin(std::numbers::pi * x / size[k]);
    }
  }
  return mesh;
}

/// Gradient of the plane over every triangle, 2 × F.
inline Eigen::Matrix2Xd face_gradients(const SurfaceMesh& mesh) {
  Eigen::Matrix2Xd gradients(2, mesh.triangle_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 1) - mesh.corner(t, 0);
    const Eigen::Vector3d b = mesh.corner(t, 2) - mesh.corner(t, 0);
    const Eigen::Vector3d n(a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
                            a.x() * b.y() - a.y() * b.x());
    gradients.col(t) = -n.head<2>() / n.z();
  }
  return gradients;
}

/// Areas of the triangles' projections onto the entry face, F.
inline Eigen::VectorXd projected_areas(const SurfaceMesh& mesh) {
  Eigen::VectorXd areas(mesh.triangle_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 1) - mesh.corner(t, 0);
    const Eigen::Vector3d b = mesh.corner(t, 2) - mesh.corner(t, 0);
    areas[t] = 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return areas;
}

}  // namespace lensforge::testing
