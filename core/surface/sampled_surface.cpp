// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/sampled_surface.h"

#include "core/surface/grid_triangles.h"

namespace lensforge {

SampledSurface make_samples(const GridShape& shape) {
  SampledSurface result;
  SurfaceMesh& mesh = result.mesh;
  mesh.grid = shape;
  mesh.vertices.resize(3, Eigen::Index{shape.columns} * shape.rows);
  mesh.triangles = grid_triangles(shape);
  result.normals.resize(3, mesh.vertices.cols());
  return result;
}

}  // namespace lensforge
