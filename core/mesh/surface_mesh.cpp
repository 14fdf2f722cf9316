// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/surface_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lensforge {

Eigen::Matrix3Xd vertex_area_normals(const SurfaceMesh& mesh) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d normal = area_normal(mesh, t);
    for (int k = 0; k < 3; ++k) normals.col(mesh.triangles(k, t)) += normal;
  }
  return normals;
}

SampledSurface make_samples(const GridShape& shape) {
  SampledSurface result;
  SurfaceMesh& mesh = result.mesh;
  mesh.grid = shape;
  mesh.vertices.resize(3, Eigen::Index{shape.columns} * shape.rows);
  mesh.triangles = grid_triangles(shape);
  result.normals.resize(3, mesh.vertices.cols());
  return result;
}

namespace {

/// Catmull–Rom weights of four equally spaced values for a point between the second and the third,
/// t = 0 … 1: C¹, exact for straight lines and parabolas.
std::array<double, 4> cubic_weights(double t) {
  return {0.5 * t * (-1.0 + t * (2.0 - t)), 1.0 + 0.5 * t * t * (-5.0 + 3.0 * t),
          0.5 * t * (1.0 + t * (4.0 - 3.0 * t)), 0.5 * t * t * (t - 1.0)};
}

/// Interpolates `value(i)`, i = 0 … last, at i + t, continued linearly beyond both ends.
/// @pre 0 ≤ i < last.
template <class Value>
auto interpolate_cubic(int i, double t, int last, const Value& value) -> decltype(value(i)) {
  using T = decltype(value(i));
  const std::array<double, 4> w = cubic_weights(t);
  const T b = value(i);
  const T c = value(i + 1);
  const T a = i > 0 ? value(i - 1) : T(2.0 * b - c);
  const T d = i + 2 <= last ? value(i + 2) : T(2.0 * c - b);
  return T(w[0] * a + w[1] * b + w[2] * c + w[3] * d);
}

/// Displacement (x, y from the flat position) and height of a grid surface at a flat position.
class GridField {
 public:
  GridField(const SurfaceMesh& mesh, const Eigen::Vector2d& size)
      : mesh_(mesh), flat_(make_grid_mesh(size, mesh.grid, 0.0)), size_(size) {}

  [[nodiscard]] Eigen::Vector3d at(double x, double y) const {
    const int cells_y = mesh_.grid.rows - 1;
    const double v = y / size_.y() * cells_y;
    const int row = std::clamp(static_cast<int>(std::floor(v)), 0, cells_y - 1);
    return interpolate_cubic(row, v - row, cells_y, [&](int r) { return along_row(r, x); });
  }

 private:
  [[nodiscard]] Eigen::Vector3d along_row(int row, double x) const {
    const int cells_x = mesh_.grid.columns - 1;
    const RowPosition p = locate_in_row(x / size_.x() * cells_x, row, cells_x);
    return interpolate_cubic(p.column, p.fraction, cells_x, [&](int column) -> Eigen::Vector3d {
      const Eigen::Index i = static_cast<Eigen::Index>(row) * mesh_.grid.columns + column;
      return mesh_.vertices.col(i) - flat_.vertices.col(i);
    });
  }

  const SurfaceMesh& mesh_;
  SurfaceMesh flat_;
  Eigen::Vector2d size_;
};

}  // namespace

SurfaceMesh make_grid_mesh(const Eigen::Vector2d& size, const GridShape& shape, double z) {
  SurfaceMesh mesh;
  mesh.grid = shape;
  const int cells_x = shape.columns - 1;
  const int cells_y = shape.rows - 1;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(shape.columns) * shape.rows);
  mesh.triangles.resize(3, 2 * static_cast<Eigen::Index>(cells_x) * cells_y);
  Eigen::Index v = 0;
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      mesh.vertices.col(v++) = Eigen::Vector3d(size.x() * (rest_column(c, r, cells_x) / cells_x),
                                               size.y() * (static_cast<double>(r) / cells_y), z);
    }
  }
  Eigen::Index t = 0;
  for (int r = 0; r < cells_y; ++r) {
    for (int c = 0; c < cells_x; ++c) {
      const int a = r * shape.columns + c;
      const int b = a + 1;
      const int d = a + shape.columns;
      const int e = d + 1;
      // The shorter diagonal: against the shift of the odd row.
      const bool even = r % 2 == 0;
      mesh.triangles.col(t++) = even ? Eigen::Vector3i(a, b, d) : Eigen::Vector3i(a, b, e);
      mesh.triangles.col(t++) = even ? Eigen::Vector3i(b, e, d) : Eigen::Vector3i(a, e, d);
    }
  }
  return mesh;
}

SurfaceMesh regrid(const SurfaceMesh& mesh, const Eigen::Vector2d& size, const GridShape& shape) {
  const GridField field(mesh, size);
  SurfaceMesh result = make_grid_mesh(size, shape, 0.0);
  for (Eigen::Index v = 0; v < result.vertices.cols(); ++v) {
    const Eigen::Index column = v % shape.columns;
    const Eigen::Index row = v / shape.columns;
    const Eigen::Vector3d flat = result.vertices.col(v);
    result.vertices.col(v) += field.at(flat.x(), flat.y());
    if (column == 0 || column == shape.columns - 1) result.vertices(0, v) = flat.x();
    if (row == 0 || row == shape.rows - 1) result.vertices(1, v) = flat.y();
  }
  return result;
}

}  // namespace lensforge
