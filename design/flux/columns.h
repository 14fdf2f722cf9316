// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Column i of a 3 × n array of doubles.
LF_HD inline Eigen::Map<const Eigen::Vector3d> column3(const double* data, std::int64_t i) {
  return Eigen::Map<const Eigen::Vector3d>(data + 3 * i);
}
LF_HD inline Eigen::Map<Eigen::Vector3d> column3(double* data, std::int64_t i) {
  return Eigen::Map<Eigen::Vector3d>(data + 3 * i);
}
/// Column i of a 2 × n array of doubles.
LF_HD inline Eigen::Map<const Eigen::Vector2d> column2(const double* data, std::int64_t i) {
  return Eigen::Map<const Eigen::Vector2d>(data + 2 * i);
}
LF_HD inline Eigen::Map<Eigen::Vector2d> column2(double* data, std::int64_t i) {
  return Eigen::Map<Eigen::Vector2d>(data + 2 * i);
}

/// Corners of a triangle from its three vertex numbers and all vertices (3 × V).
LF_HD inline Corners corners_at(const int* triangle, const double* vertices) {
  return {column3(vertices, triangle[0]), column3(vertices, triangle[1]),
          column3(vertices, triangle[2])};
}

}  // namespace lensforge
