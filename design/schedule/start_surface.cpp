// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/start_surface.h"

#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "design/schedule/face_transport.h"

namespace lensforge {
namespace {

/// The slopes that are wanted depend on the heights: each pass brings both nearer by the heights'
/// range over the distance to where the front gathers light, a tenth or so.
constexpr int kPasses = 4;

}  // namespace

void shape_start(const OpticalSetup& setup, double thickness, const Executor& executor,
                 SurfaceMesh& mesh) {
  const LightPath light(setup);
  if (light.starts_flat()) return;
  Correspondence parallel;
  parallel.centroids.resize(2, mesh.triangles.cols());
  for (int pass = 0; pass < kPasses; ++pass) {
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
      const Corners t = mesh.corners(f);
      parallel.centroids.col(f) = light.land_from_start((t.v0 + t.v1 + t.v2) / 3.0);
    }
    aim_faces(parallel, setup, executor, mesh);
    mesh.vertices.row(2).array() += thickness - mesh.vertices.row(2).minCoeff();
  }
}

SurfaceMesh start_surface(const OpticalSetup& setup, GridShape grid, double thickness,
                          const Executor& executor) {
  SurfaceMesh mesh = make_grid_mesh(setup.lens_size, grid, thickness);
  shape_start(setup, thickness, executor, mesh);
  return mesh;
}

}  // namespace lensforge
