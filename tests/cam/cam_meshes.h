// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>

#include "core/surface_mesh.h"

namespace lensforge::testing {

/// Height over (x, y), mm.
using HeightFunction = std::function<double(double, double)>;

/// A grid of columns × rows vertices over width × height mm with the heights of `z`; every cell is
/// split along the same diagonal.
inline SurfaceMesh grid_mesh(int columns, int rows, double width, double height,
                             const HeightFunction& z) {
  SurfaceMesh mesh;
  mesh.grid = {columns, rows};
  mesh.vertices.resize(3, std::int64_t{columns} * rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double x = width * c / (columns - 1);
      const double y = height * r / (rows - 1);
      mesh.vertices.col(std::int64_t{r} * columns + c) << x, y, z(x, y);
    }
  }
  mesh.triangles.resize(3, std::int64_t{2} * (columns - 1) * (rows - 1));
  std::int64_t t = 0;
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      const int v = r * columns + c;
      mesh.triangles.col(t++) << v, v + 1, v + columns + 1;
      mesh.triangles.col(t++) << v, v + columns + 1, v + columns;
    }
  }
  return mesh;
}

/// Relief like a designed lens's, mm: waves of ±0.5 mm with slopes up to 0.3, and a net of valleys
/// where neighbouring faces meet.
inline double lens_relief(double x, double y) {
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  const double waves = 0.22 * std::sin(kTwoPi * x / 23.0 + 0.4) * std::cos(kTwoPi * y / 31.0) +
                       0.16 * std::sin(kTwoPi * (x + 0.7 * y) / 11.0) +
                       0.10 * std::cos(kTwoPi * (0.4 * x - y) / 7.0 + 1.0);
  const double crease_a = std::abs(std::remainder(x + 0.3 * y, 12.5)) * 0.05;
  const double crease_b = std::abs(std::remainder(y - 0.2 * x, 17.0)) * 0.04;
  return 6.0 + waves + crease_a + crease_b;
}

}  // namespace lensforge::testing
