// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/facet_surface.h"

#include <array>

#include "core/surface/mesh_normals.h"

namespace lensforge {

SurfacePoint FacetSurface::in_triangle(std::int64_t triangle,
                                       const Eigen::Vector3d& weights) const {
  const Eigen::Vector3d normal = area_normal(mesh(), triangle);
  SurfacePoint point;
  for (int k = 0; k < 3; ++k) point.z += weights[k] * mesh().corner(triangle, k).z();
  point.slope = -normal.head<2>() / normal.z();
  return point;
}

/// The Bernstein coefficients of a plane are its heights at their domain points.
SmoothPatch FacetSurface::patch_in(std::int64_t triangle,
                                   const Eigen::Vector3d& /*weights*/) const {
  std::array<Eigen::Vector2d, 3> corners;
  std::array<double, 3> z{};
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d corner = mesh().corner(triangle, k);
    corners[static_cast<std::size_t>(k)] = corner.head<2>();
    z[static_cast<std::size_t>(k)] = corner.z();
  }
  const auto mean = [&](double a, double b, double c) {
    return (a * z[0] + b * z[1] + c * z[2]) / 3.0;
  };
  return {corners,
          {z[0], z[1], z[2], mean(2, 1, 0), mean(1, 2, 0), mean(2, 0, 1), mean(0, 2, 1),
           mean(1, 1, 1), mean(1, 0, 2), mean(0, 1, 2)}};
}

}  // namespace lensforge
