// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "core/mesh/surface_mesh.h"

namespace lensforge::testing {

/// A grid over [0, width] × [0, height] whose vertices lie on z = f(x, y).
template <class Height>
SurfaceMesh surface_of(const Eigen::Vector2d& size, const GridShape& shape, const Height& f) {
  SurfaceMesh mesh = make_grid_mesh(size, shape, 0.0);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices(2, v) = f(mesh.vertices(0, v), mesh.vertices(1, v));
  }
  return mesh;
}

/// A gentle lens-like surface, 30 × 24 mm.
inline SurfaceMesh smooth_lens(int columns = 31) {
  const auto rows = static_cast<int>(std::lround((columns - 1) * kRowsPerColumn * 0.8)) + 1;
  return surface_of({30.0, 24.0}, {columns, rows}, [](double x, double y) {
    return 5.0 + 0.4 * std::sin(0.2 * x) + 0.3 * std::cos(0.25 * y + 0.1 * x);
  });
}

/// Two planes that meet in a valley which crosses the grid at a slant.
inline SurfaceMesh creased_lens() {
  return surface_of({20.0, 20.0}, {25, 29},
                    [](double x, double y) { return 5.0 + 0.05 * std::abs(x + 0.3 * y - 13.0); });
}

/// The gentle lens with vertices moved at random: in height by 1 µm, sideways by a fifth of a cell.
inline SurfaceMesh noisy_lens(std::uint32_t seed = 7) {
  SurfaceMesh mesh = smooth_lens();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices(2, v) += 1e-3 * unit(random);
    const Eigen::Index column = v % mesh.grid.columns;
    const Eigen::Index row = v / mesh.grid.columns;
    const bool inside =
        column > 0 && row > 0 && column + 1 < mesh.grid.columns && row + 1 < mesh.grid.rows;
    if (inside) mesh.vertices.col(v).head<2>() += 0.2 * Eigen::Vector2d(unit(random), unit(random));
  }
  return mesh;
}

/// A steep rise in the middle, to which the vertices have moved: cells are a fifth as wide there.
inline SurfaceMesh crowded_lens(int columns = 41) {
  const auto rows = static_cast<int>(std::lround((columns - 1) * kRowsPerColumn * 0.8)) + 1;
  SurfaceMesh mesh = make_grid_mesh({30.0, 24.0}, {columns, rows}, 0.0);
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    double& x = mesh.vertices(0, v);
    double& y = mesh.vertices(1, v);
    x += 0.8 * std::sin(kTwoPi * x / 30.0) * 30.0 / kTwoPi;
    y += 0.3 * std::sin(kTwoPi * y / 24.0) * 24.0 / kTwoPi;
    mesh.vertices(2, v) = 5.0 + 0.2 * std::tanh((x - 15.0) / 0.7) + 0.1 * std::sin(0.2 * y);
  }
  return mesh;
}

}  // namespace lensforge::testing
