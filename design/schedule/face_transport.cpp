// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/face_transport.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/optics/light_path.h"
#include "core/surface/mesh_cut.h"
#include "design/render/render_flux.h"
#include "design/schedule/transport_sites.h"

namespace lensforge {

namespace {

/// Of a face's light: less than this share inside of the outline counts as none. Cells that hold
/// next to no light hold up all others.
constexpr double kLeastShare = 0.05;

/// Flux of faces of which next to nothing lies inside of the outline.
void drop_slivers(const SurfaceMesh& mesh, const Outline& outline, const Executor& executor,
                  Eigen::VectorXd& flux) {
  const MeshCut cut = cut_mesh(mesh, outline, executor);
  for (Eigen::Index f = 0; f < flux.size(); ++f) {
    if (cut.share[static_cast<std::size_t>(f)] < kLeastShare) flux[f] = 0.0;
  }
}

}  // namespace

FaceLight face_light(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                     const Executor& executor) {
  const std::vector<ImageTriangle> images = project_surface(mesh, setup, model, executor);
  const TransportSites transport(setup);
  FaceLight light;
  light.landing.resize(2, mesh.triangles.cols());
  light.flux.resize(mesh.triangles.cols());
  for (Eigen::Index f = 0; f < light.flux.size(); ++f) {
    const ImageTriangle& t = images[static_cast<std::size_t>(f)];
    light.landing.col(f) = (t.p0 + t.p1 + t.p2) / 3.0;
    light.flux[f] = t.flux;
  }
  light.sites.resize(2, light.landing.cols());
  for (Eigen::Index f = 0; f < light.sites.cols(); ++f) {
    light.sites.col(f) = transport.site(light.landing.col(f));
  }
  if (setup.outline) drop_slivers(mesh, *setup.outline, executor, light.flux);
  return light;
}

TransportResult transport_faces(const FaceLight& light, const Image& target,
                                const TransportOptions& options, const Executor& executor,
                                const RunControl& control) {
  return solve_semi_discrete(light.sites, light.flux, target, options, executor, control);
}

Eigen::Matrix2Xd map_faces(const FaceLight& light, const BrenierMap& map,
                           const Executor& executor) {
  Eigen::Matrix2Xd landing(2, light.sites.cols());
  parallel_for(executor, "map faces", landing.cols(),
               [&](std::int64_t f) { landing.col(f) = map(light.sites.col(f)); });
  return landing;
}

void aim_faces(const Correspondence& correspondence, const OpticalSetup& setup,
               const Executor& executor, SurfaceMesh& mesh, const HeightFitOptions& fit) {
  const LightPath light(setup);
  Eigen::Matrix2Xd gradients(2, mesh.triangles.cols());
  parallel_for(executor, "aim faces", mesh.triangles.cols(), [&](std::int64_t f) {
    const auto t = mesh.triangles.col(f);
    const Eigen::Vector3d c =
        (mesh.vertices.col(t[0]) + mesh.vertices.col(t[1]) + mesh.vertices.col(t[2])) / 3.0;
    gradients.col(f) = light.gradient_for(c, correspondence.centroids.col(f));
  });
  fit_face_gradients(gradients, fit, executor, mesh);
}

}  // namespace lensforge
