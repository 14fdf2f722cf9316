// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/surface_optics.h"

#include <cstddef>

#include "core/surface/lit_surface.h"
#include "core/surface/mesh_normals.h"
#include "design/optics/facet.h"
#include "design/optics/surface_kernels.h"

namespace lensforge {

namespace {

SurfaceView view_of(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  return {mesh.triangles.data(), mesh.vertices.data(), light_on(mesh, setup)};
}

template <class Project>
std::vector<ImageTriangle> project_all(const char* kernel, const SurfaceMesh& mesh,
                                       const Project& project, const Executor& executor) {
  std::vector<ImageTriangle> triangles(static_cast<std::size_t>(mesh.triangle_count()));
  parallel_for(executor, kernel, mesh.triangle_count(),
               [&](std::int64_t i) { triangles[static_cast<std::size_t>(i)] = project(i); });
  return triangles;
}

/// Landing points of all vertices; NaN where a vertex does not transmit.
Eigen::Matrix2Xd land_rays(const SurfaceMesh& mesh, const SurfaceView& surface,
                           const Executor& executor) {
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  Eigen::Matrix2Xd landing(2, mesh.vertex_count());
  parallel_for(executor, "project vertices", mesh.vertex_count(),
               LandRay{surface, normals.data(), landing.data()});
  return landing;
}

}  // namespace

std::vector<ImageTriangle> project_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                           SurfaceModel model, const Executor& executor) {
  const SurfaceView surface = view_of(mesh, setup);
  if (model == SurfaceModel::kFacet) {
    return project_all("project facets", mesh, ProjectFacet{surface}, executor);
  }
  const Eigen::Matrix2Xd landing = land_rays(mesh, surface, executor);
  return project_all("project smooth", mesh, ProjectSmooth{surface, landing.data()}, executor);
}

}  // namespace lensforge
