// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optics/surface_optics.h"

#include <cmath>
#include <cstddef>
#include <limits>

#include "design/optics/facet.h"
#include "design/optics/projection.h"
#include "design/optics/smooth.h"

namespace lensforge {

namespace {

Corners corners_of(const SurfaceMesh& mesh, std::int64_t t) {
  return {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
}

std::vector<ImageTriangle> project_facets(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                          const Executor& executor) {
  const Projection optics(setup);
  const double lens_area = setup.lens_size.prod();
  std::vector<ImageTriangle> triangles(static_cast<std::size_t>(mesh.triangle_count()));
  parallel_for(executor, "project facets", mesh.triangle_count(), [&](std::int64_t i) {
    const Corners t = corners_of(mesh, i);
    const Eigen::Vector3d n = area_normal(t).normalized();
    if (!optics.transmits(n)) return;  // An image triangle without flux.
    triangles[static_cast<std::size_t>(i)] =
        project_facet(t, RefractedBeam(n, optics.eta), optics, lens_area);
  });
  return triangles;
}

/// Landing points of all vertices; NaN where a vertex does not transmit.
Eigen::Matrix2Xd project_vertices(const SurfaceMesh& mesh, const Projection& optics,
                                  const Executor& executor) {
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  Eigen::Matrix2Xd landing(2, mesh.vertex_count());
  parallel_for(executor, "project vertices", mesh.vertex_count(), [&](std::int64_t v) {
    const Eigen::Vector3d n = VertexNormal(normals.col(v)).n;
    if (optics.transmits(n)) {
      landing.col(v) = project_vertex(mesh.vertices.col(v), n, optics);
    } else {
      landing.col(v).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  });
  return landing;
}

std::vector<ImageTriangle> project_smooth(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                          const Executor& executor) {
  const Eigen::Matrix2Xd landing = project_vertices(mesh, Projection(setup), executor);
  const double lens_area = setup.lens_size.prod();
  std::vector<ImageTriangle> triangles(static_cast<std::size_t>(mesh.triangle_count()));
  parallel_for(executor, "project smooth", mesh.triangle_count(), [&](std::int64_t i) {
    const Eigen::Vector3i v = mesh.triangles.col(i);
    ImageTriangle& image = triangles[static_cast<std::size_t>(i)];
    image = {landing.col(v[0]), landing.col(v[1]), landing.col(v[2]),
             0.5 * area_normal(corners_of(mesh, i)).z() / lens_area};
    const bool lit = image.p0.allFinite() && image.p1.allFinite() && image.p2.allFinite();
    if (!lit || image.flux < 0.0) image = {};
  });
  return triangles;
}

}  // namespace

Eigen::Matrix3Xd vertex_area_normals(const SurfaceMesh& mesh) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d normal = area_normal(corners_of(mesh, t));
    for (int k = 0; k < 3; ++k) normals.col(mesh.triangles(k, t)) += normal;
  }
  return normals;
}

std::vector<ImageTriangle> project_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                           SurfaceModel model, const Executor& executor) {
  return model == SurfaceModel::kFacet ? project_facets(mesh, setup, executor)
                                       : project_smooth(mesh, setup, executor);
}

}  // namespace lensforge
