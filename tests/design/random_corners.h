// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/mesh/surface_mesh.h"
#include "design/random_input.h"

namespace lensforge::testing {

/// A surface triangle of about a millimetre that faces +z and lets light out.
inline Corners random_corners(Random& random) {
  const Eigen::Vector3d centre = Eigen::Vector3d(50.0, 40.0, 6.0) + 5.0 * random.vector3();
  const auto corner = [&](double x, double y) -> Eigen::Vector3d {
    return centre + Eigen::Vector3d(x, y, 0.0) + 0.2 * random.vector3();
  };
  return {corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)};
}

inline Eigen::VectorXd pack(const Corners& t) {
  Eigen::VectorXd x(9);
  x << t.v0, t.v1, t.v2;
  return x;
}

inline Corners unpack_corners(const Eigen::VectorXd& x) {
  return {x.segment<3>(0), x.segment<3>(3), x.segment<3>(6)};
}

}  // namespace lensforge::testing
