// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/sampled_surface.h"

namespace lensforge {

SampledSurface make_samples(const GridShape& shape) {
  SampledSurface result;
  SurfaceMesh& mesh = result.mesh;
  mesh.grid = shape;
  mesh.vertices.resize(3, Eigen::Index{shape.columns} * shape.rows);
  mesh.triangles.resize(3, Eigen::Index{2} * (shape.columns - 1) * (shape.rows - 1));
  result.normals.resize(3, mesh.vertices.cols());
  Eigen::Index t = 0;
  for (int r = 0; r + 1 < shape.rows; ++r) {
    for (int c = 0; c + 1 < shape.columns; ++c) {
      const int at = r * shape.columns + c;
      mesh.triangles.col(t++) << at, at + 1, at + shape.columns + 1;
      mesh.triangles.col(t++) << at, at + shape.columns + 1, at + shape.columns;
    }
  }
  return result;
}

}  // namespace lensforge
