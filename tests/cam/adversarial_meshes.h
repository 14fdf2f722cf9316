// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "cam/cam_meshes.h"

namespace lensforge::testing {

/// Heights that jump at random from vertex to vertex.
inline SurfaceMesh noise_mesh(int columns, double side, double height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, height);
  return grid_mesh(columns, columns, side, side,
                   [&](double, double) { return 5.0 + unit(random); });
}

/// A valley (bend > 0) or ridge through the middle that runs `angle` rad off the x axis.
inline SurfaceMesh crease_mesh(int columns, double side, double angle, double bend) {
  return grid_mesh(columns, columns, side, side, [=](double x, double y) {
    const double off = (y - 0.5 * side) * std::cos(angle) - (x - 0.5 * side) * std::sin(angle);
    return 5.0 + 0.1 * x - 0.07 * y + bend * std::abs(off);
  });
}

/// Terraces with walls as steep as one cell allows.
inline SurfaceMesh step_mesh(int columns, double side, double step) {
  return grid_mesh(columns, columns, side, side, [=](double x, double y) {
    return 5.0 + step * std::floor(2.3 * (x + 0.31 * y) / side * 2.0);
  });
}

/// Columns of very different width: triangles a thousand times as long as wide.
inline SurfaceMesh needle_mesh(int columns, double side) {
  SurfaceMesh mesh = grid_mesh(columns, 5, side, side, lens_relief);
  for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) {
    const auto column = static_cast<int>(v % columns);
    const double pair = std::floor(0.5 * column) * 2.0 * side / (columns - 1);
    if (column % 2 == 1 && column + 1 < columns) mesh.vertices(0, v) = pair + 2e-4 * side;
    mesh.vertices(2, v) = 5.0 + 0.2 * std::abs(std::sin(3.0 * mesh.vertices(0, v))) +
                          0.1 * std::cos(1.7 * mesh.vertices(1, v)) + 0.01 * (column % 3);
  }
  return mesh;
}

/// Triangles that have nothing to do with each other over a floor.
inline SurfaceMesh soup_mesh(int count, double side, unsigned seed) {
  SurfaceMesh mesh = grid_mesh(3, 3, side, side, [](double, double) { return 5.0; });
  mesh.grid = {};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const std::int64_t vertices = mesh.vertex_count();
  const std::int64_t triangles = mesh.triangle_count();
  mesh.vertices.conservativeResize(3, vertices + 3 * count);
  mesh.triangles.conservativeResize(3, triangles + count);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d middle(side * unit(random), side * unit(random), 5.0);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d way(unit(random) - 0.5, unit(random) - 0.5, 0.5 * unit(random));
      mesh.vertices.col(vertices + 3 * i + k) = middle + 0.4 * way;
      mesh.triangles(k, triangles + i) = static_cast<int>(vertices + 3 * i + k);
    }
  }
  return mesh;
}

/// All of the above, four millimetres wide, with names.
inline std::vector<std::pair<std::string, SurfaceMesh>> adversarial_meshes() {
  constexpr double kSide = 4.0;
  std::vector<std::pair<std::string, SurfaceMesh>> meshes;
  meshes.emplace_back("relief", grid_mesh(28, 31, kSide, kSide, [](double x, double y) {
                        return lens_relief(3.0 * x, 3.0 * y) + 0.2 * std::abs(x - 1.234 + 0.3 * y);
                      }));
  for (const double angle : {0.0, 0.02, 0.7, 1.55, 1.5707963267948966}) {
    meshes.emplace_back("valley " + std::to_string(angle), crease_mesh(24, kSide, angle, 0.3));
    meshes.emplace_back("ridge " + std::to_string(angle), crease_mesh(23, kSide, angle, -0.3));
  }
  meshes.emplace_back("noise", noise_mesh(30, kSide, 0.05, 1));
  meshes.emplace_back("rough noise", noise_mesh(60, kSide, 0.3, 2));
  meshes.emplace_back("steps", step_mesh(31, kSide, 0.2));
  meshes.emplace_back("needles", needle_mesh(41, kSide));
  meshes.emplace_back("soup", soup_mesh(60, kSide, 3));
  return meshes;
}

}  // namespace lensforge::testing
