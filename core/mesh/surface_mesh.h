// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/compute/host_device.h"
#include "core/compute/lanes.h"

namespace lensforge {

/// Corners of a surface triangle, or the derivative of a scalar by them. Millimetres. T is a
/// double, or a vector of the doubles of several triangles (core/compute/lanes.h), each with the
/// same bits.
template <class T>
struct CornersOf {
  SpaceVector<T> v0{T{}, T{}, T{}};
  SpaceVector<T> v1{T{}, T{}, T{}};
  SpaceVector<T> v2{T{}, T{}, T{}};
};
using Corners = CornersOf<double>;

/// z of a × b for vectors in the xy plane: twice the signed area of the triangle (0, a, b).
LF_HD inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// (v1 − v0) × (v2 − v0): the normal times twice the area (numerator of Sun et al., Eq. 4).
template <class T = double>
LF_HD LF_INLINE SpaceVector<T> area_normal(const CornersOf<T>& t) {
  const SpaceVector<T> u = t.v1 - t.v0;
  const SpaceVector<T> v = t.v2 - t.v0;
  // Not u.cross(v): GCC 12 leaves it as a call, an eighth of an objective's time.
  return {u.y() * v.z() - u.z() * v.y(), u.z() * v.x() - u.x() * v.z(),
          u.x() * v.y() - u.y() * v.x()};
}

/// Area of a triangle seen from +z, half the z of area_normal(); negative if clockwise.
template <class T = double>
LF_HD LF_INLINE T plan_area(const CornersOf<T>& t) {
  return 0.5 * ((t.v1.x() - t.v0.x()) * (t.v2.y() - t.v0.y()) -
                (t.v1.y() - t.v0.y()) * (t.v2.x() - t.v0.x()));
}

/// Adjoint of area_normal(): adds to the corners' derivatives.
template <class T = double>
LF_HD LF_INLINE void area_normal_adjoint(const CornersOf<T>& t, const SpaceVector<T>& bar,
                                         CornersOf<T>& grad) {
  const SpaceVector<T> d1 = (t.v2 - t.v0).cross(bar);
  const SpaceVector<T> d2 = bar.cross(t.v1 - t.v0);
  grad.v1 += d1;
  grad.v2 += d2;
  grad.v0 -= d1 + d2;
}

/// Adjoint of N ↦ n = N/|N|.
template <class T = double>
LF_HD LF_INLINE SpaceVector<T> normalize_adjoint(const SpaceVector<T>& n, const T& length,
                                                 const SpaceVector<T>& n_bar) {
  return (1.0 / length) * (n_bar - n.dot(n_bar) * n);
}

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

/// A triangle's normal times twice its area, mm².
inline Eigen::Vector3d area_normal(const SurfaceMesh& mesh, std::int64_t triangle) {
  return area_normal(mesh.corners(triangle));
}

/// The sum of the area normals around every vertex, 3 × V, mm²: the vertex normals of the smooth
/// model before they are normalised.
Eigen::Matrix3Xd vertex_area_normals(const SurfaceMesh& mesh);

/// Points of a smooth surface, the triangles between them, and the surface's own normals there: the
/// normals send the surface's own light, however coarse the triangles.
struct SampledSurface {
  SurfaceMesh mesh;
  Eigen::Matrix3Xd normals;  ///< 3 × V, z > 0, of any length.
};

/// A grid of points still to be filled in, row by row, with its triangles.
SampledSurface make_samples(const GridShape& shape);

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

// Grid meshes: the vertices of a lens's flat grid form rows of near-equilateral triangles.

/// Cells next to the border over which the half-cell shift of odd rows grows from 0 to full.
inline constexpr int kShiftFade = 4;

/// x of a flat grid's vertex, in cells: every other row is moved half a cell to the right, and near
/// the left and right border the shift fades out, so that all rows end on the border.
inline double rest_column(int column, int row, int cells) {
  const int from_border = std::min(column, cells - column);
  const double shift = 0.5 * std::min(1.0, static_cast<double>(from_border) / kShiftFade);
  return column + (row % 2 == 1 ? shift : 0.0);
}

/// Position of x (in cells) in a row: a column and the fraction to the next one.
struct RowPosition {
  int column = 0;
  double fraction = 0.0;
};

/// @pre cells ≥ 1.
inline RowPosition locate_in_row(double x, int row, int cells) {
  int column = std::clamp(static_cast<int>(x), 0, cells - 1);
  while (column > 0 && rest_column(column, row, cells) > x) --column;
  const double left = rest_column(column, row, cells);
  const double right = rest_column(column + 1, row, cells);
  return {column, std::clamp((x - left) / (right - left), 0.0, 1.0)};
}

/// Rows per column of a grid of near-equilateral triangles, 2/√3 rounded so that the usual sizes
/// stay whole under halving (641 × 737 vertices: 640 × 1.15 = 736).
inline constexpr double kRowsPerColumn = 1.15;

/// A flat mesh over [0, size.x] × [0, size.y] at height z: `shape` vertices in rows, every other
/// row moved half a cell to the right so that the triangles are nearly equilateral. Near the left
/// and right border the shift fades out over kShiftFade cells, so that all rows end on the border.
/// @pre shape.columns, shape.rows ≥ 2.
SurfaceMesh make_grid_mesh(const Eigen::Vector2d& size, const GridShape& shape, double z);

/// The same surface on another grid over the same rectangle: displacements from the flat mesh's
/// positions and heights are interpolated by cubics (Catmull–Rom), once along rows and once across.
/// Planes are preserved, except in the cells of unequal width next to the left and right border
/// (error about 1 % of a cell's rise). Border vertices stay on the border. @pre mesh.grid is set
/// and at least 2 × 2.
SurfaceMesh regrid(const SurfaceMesh& mesh, const Eigen::Vector2d& size, const GridShape& shape);

// Topology.

/// Adjacency of a triangle mesh, as flat arrays for the kernels.
struct MeshTopology {
  /// 3 × T: triangle across edge k of a triangle (edge k runs from corner k to corner k+1 mod 3);
  /// −1 at the boundary.
  Eigen::Matrix3Xi neighbours;
  /// Corners around vertex v are vertex_corners[vertex_corner_begin[v] … vertex_corner_begin[v+1]),
  /// each as 3·triangle + k, ascending.
  std::vector<std::int32_t> vertex_corner_begin;
  std::vector<std::int32_t> vertex_corners;
  /// Vertices that share an edge with vertex v, in the same compressed form, ascending.
  std::vector<std::int32_t> vertex_neighbour_begin;
  std::vector<std::int32_t> vertex_neighbours;
  /// 1 for a vertex on the mesh's boundary, else 0.
  std::vector<std::uint8_t> on_boundary;
};

/// Builds the tables through OpenMesh.
/// @throw InputError if the mesh is not a manifold (an edge with three triangles, a triangle
///        oriented against its neighbour).
MeshTopology make_topology(const SurfaceMesh& mesh);

}  // namespace lensforge
