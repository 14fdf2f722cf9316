// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/compute/host_device.h"

namespace lensforge {

/// Corners of a surface triangle, or the derivative of a scalar by them. Millimetres.
struct Corners {
  Eigen::Vector3d v0{0.0, 0.0, 0.0};
  Eigen::Vector3d v1{0.0, 0.0, 0.0};
  Eigen::Vector3d v2{0.0, 0.0, 0.0};
};

/// z of a × b for vectors in the xy plane: twice the signed area of the triangle (0, a, b).
LF_HD inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// (v1 − v0) × (v2 − v0): the normal times twice the area (numerator of Sun et al., Eq. 4).
LF_HD inline Eigen::Vector3d area_normal(const Corners& t) {
  const Eigen::Vector3d u = t.v1 - t.v0;
  const Eigen::Vector3d v = t.v2 - t.v0;
  // Not u.cross(v): GCC 12 leaves it as a call, an eighth of an objective's time.
  return {u.y() * v.z() - u.z() * v.y(), u.z() * v.x() - u.x() * v.z(),
          u.x() * v.y() - u.y() * v.x()};
}

/// Area of a triangle seen from +z, half the z of area_normal(); negative if clockwise.
LF_HD inline double plan_area(const Corners& t) {
  return 0.5 * ((t.v1.x() - t.v0.x()) * (t.v2.y() - t.v0.y()) -
                (t.v1.y() - t.v0.y()) * (t.v2.x() - t.v0.x()));
}

/// Adjoint of area_normal(): adds to the corners' derivatives.
LF_HD inline void area_normal_adjoint(const Corners& t, const Eigen::Vector3d& bar, Corners& grad) {
  const Eigen::Vector3d d1 = (t.v2 - t.v0).cross(bar);
  const Eigen::Vector3d d2 = bar.cross(t.v1 - t.v0);
  grad.v1 += d1;
  grad.v2 += d2;
  grad.v0 -= d1 + d2;
}

/// Adjoint of N ↦ n = N/|N|.
LF_HD inline Eigen::Vector3d normalize_adjoint(const Eigen::Vector3d& n, double length,
                                               const Eigen::Vector3d& n_bar) {
  return (1.0 / length) * (n_bar - n.dot(n_bar) * n);
}

}  // namespace lensforge
