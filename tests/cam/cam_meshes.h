// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>

#include "core/lens/lens.h"
#include "core/test_meshes.h"

namespace lensforge::testing {

/// Height over (x, y), mm.
using HeightFunction = std::function<double(double, double)>;

/// A grid of columns × rows vertices over width × height mm with the heights of `z`; every cell is
/// split along the same diagonal.
inline SurfaceMesh grid_mesh(int columns, int rows, double width, double height,
                             const HeightFunction& z) {
  SurfaceMesh mesh = grid_mesh(columns, rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double x = width * c / (columns - 1);
      const double y = height * r / (rows - 1);
      mesh.vertices.col(std::int64_t{r} * columns + c) << x, y, z(x, y);
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

/// A lens of that relief, its light on a wall of its own size 12 mm away; an even grey is wanted.
inline Lens small_lens(double width = 3.0, double height = 2.0) {
  Lens lens;
  lens.model = SurfaceModel::kSmooth;
  lens.setup.lens_size = {width, height};
  lens.setup.image_size = {width, height};
  lens.setup.pixels = {12, 8};
  lens.setup.focal_length = 12.0;
  lens.surface = grid_mesh(21, 17, width, height, lens_relief);
  lens.target = Image(12, 8, 1.0F);
  return lens;
}

}  // namespace lensforge::testing
