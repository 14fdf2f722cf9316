// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/surface/corners.h"

namespace lensforge {

/// Vertices per row and number of rows of a grid mesh; {0, 0} for other meshes.
struct GridShape {
  int columns = 0;
  int rows = 0;

  [[nodiscard]] bool is_grid() const { return columns > 0 && rows > 0; }
  friend bool operator==(const GridShape&, const GridShape&) = default;
};

/// A triangle mesh as flat arrays, millimetres in the lens frame (x right, y away, z along the
/// light; seen from +z the triangles run counter-clockwise).
struct SurfaceMesh {
  Eigen::Matrix3Xd vertices;  ///< 3 × V, mm. On a grid vertex (column, row) is row·columns+column.
  Eigen::Matrix3Xi triangles;  ///< 3 × T, vertex numbers.
  GridShape grid;              ///< Set when the vertices are the rows of a grid, y upwards.

  [[nodiscard]] std::int64_t vertex_count() const { return vertices.cols(); }
  [[nodiscard]] std::int64_t triangle_count() const { return triangles.cols(); }
  [[nodiscard]] Eigen::Vector3d corner(std::int64_t triangle, int k) const {
    return vertices.col(triangles(k, triangle));
  }
  [[nodiscard]] Corners corners(std::int64_t triangle) const {
    return {corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)};
  }
  /// Area of a triangle seen from +z, mm²; negative if clockwise. For its light see
  /// LightPath::intake().
  [[nodiscard]] double plan_area(std::int64_t triangle) const {
    return lensforge::plan_area(corners(triangle));
  }
};

}  // namespace lensforge
