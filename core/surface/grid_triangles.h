// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Two triangles for every cell of a regular grid of samples, split from the first corner to the
/// opposite one, in row order. @pre at least 2 × 2 vertices.
inline Eigen::Matrix3Xi grid_triangles(const GridShape& shape) {
  Eigen::Matrix3Xi triangles(3, Eigen::Index{2} * (shape.columns - 1) * (shape.rows - 1));
  Eigen::Index t = 0;
  for (int row = 0; row + 1 < shape.rows; ++row) {
    for (int column = 0; column + 1 < shape.columns; ++column) {
      const int a = row * shape.columns + column;
      const int d = a + shape.columns;
      triangles.col(t++) << a, a + 1, d + 1;
      triangles.col(t++) << a, d + 1, d;
    }
  }
  return triangles;
}

}  // namespace lensforge
