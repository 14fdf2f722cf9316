// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render/surface_optics.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/surface/lit_surface.h"
#include "core/surface/mesh_cut.h"
#include "core/surface/mesh_normals.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

namespace {

/// A surface that may be cut by an outline, and the rays that enter it.
struct Scene {
  const SurfaceMesh& mesh;
  const std::optional<MeshCut> cut;
  std::vector<IncidentRay> rays;
  SurfaceView view;

  Scene(const SurfaceMesh& surface, const OpticalSetup& setup, const Executor& executor)
      : mesh(surface),
        cut(setup.outline ? std::optional(cut_mesh(surface, *setup.outline, executor))
                          : std::nullopt),
        view{surface.triangles.data(),
             surface.vertices.data(),
             cut ? light_inside(surface, *cut, setup) : light_on(surface, setup),
             {}} {
    view.incident = find_rays(executor, view.light, view.vertices, mesh.vertex_count(), rays);
  }
};

template <class Project>
std::vector<ImageTriangle> project_all(const char* kernel, const Scene& scene,
                                       const Project& project, const Executor& executor) {
  const std::int64_t count = scene.mesh.triangle_count();
  std::vector<ImageTriangle> triangles(static_cast<std::size_t>(count));
  parallel_for(executor, kernel, count, [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    triangles[at] = project(i);
    if (scene.cut) triangles[at].flux *= scene.cut->share[at];
  });
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
  const Scene scene(mesh, setup, executor);
  if (model == SurfaceModel::kFacet) {
    return project_all("project facets", scene, ProjectFacet{scene.view}, executor);
  }
  const Eigen::Matrix2Xd landing = land_rays(mesh, scene.view, executor);
  return project_all("project smooth", scene, ProjectSmooth{scene.view, landing.data()}, executor);
}

}  // namespace lensforge
