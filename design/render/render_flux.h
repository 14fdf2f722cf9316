// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"
#include "design/flux/flux_image.h"
#include "design/flux/flux_triangle.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

/// Flux that a surface sends to every pixel, as shares of the lens's total, row by row from the
/// top. Computed on any executor, returned in the caller's memory.
/// @param normals_given  3 × V, for the smooth model; nullptr: the mesh's own.
template <class Exec>
std::vector<double> render_flux(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                SurfaceModel model, const Exec& executor,
                                const Eigen::Matrix3Xd* normals_given = nullptr) {
  const auto numbers = [](const auto& matrix) {
    return std::span(matrix.data(), static_cast<std::size_t>(matrix.size()));
  };
  const auto triangles = buffer_of(executor, numbers(mesh.triangles));
  const auto vertices = buffer_of(executor, numbers(mesh.vertices));
  // Without known rays: for a spline's four million nodes they take 0.5 GB.
  typename Exec::template Buffer<double> front;
  const LightPath light = light_for(executor, light_on(mesh, setup), front);
  const SurfaceView surface{triangles.data(), vertices.data(), light, {}};
  FluxImageOn<Exec> image(setup.pixels.x(), setup.pixels.y());
  std::vector<double> flux(static_cast<std::size_t>(setup.pixels.prod()));
  const std::int64_t count = mesh.triangle_count();
  if (model == SurfaceModel::kFacet) {
    download(executor, image.render(executor, count, ProjectFacet{surface}), std::span(flux));
    return flux;
  }
  const auto normals = normals_given != nullptr
                           ? buffer_of(executor, numbers(*normals_given))
                           : buffer_of(executor, numbers(vertex_area_normals(mesh)));
  typename Exec::template Buffer<double> landing(2 * static_cast<std::size_t>(mesh.vertex_count()));
  parallel_for(executor, "project vertices", mesh.vertex_count(),
               LandRay{surface, normals.data(), landing.data()});
  const ProjectSmooth source{surface, landing.data()};
  download(executor, image.render(executor, count, source), std::span(flux));
  return flux;
}

#if defined(LENSFORGE_CUDA)
/// render_flux() on the GPU. @throw RunError if its memory does not suffice.
std::vector<double> render_flux_cuda(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                     SurfaceModel model, const Executor& executor);
#endif

/// render_flux() of a spline by its own normals at picture_nodes(). Nodes are computed strip by
/// strip and not kept. The picture is the same as with all nodes: to rounding in the light of a
/// point, else to the bit.
std::vector<double> render_spline(const ControlNet& net, const OpticalSetup& setup,
                                  const Executor& executor);

/// The same with `samples` nodes per knot cell each way.
std::vector<double> render_spline(const ControlNet& net, int samples, const OpticalSetup& setup,
                                  const Executor& executor);

/// Image triangles of a whole surface under either model, one per mesh triangle, in pixel
/// coordinates. Triangles that reflect the light totally have no flux; triangles across the lens's
/// outline have the flux of the part inside.
/// @pre the mesh's triangle indices are in range.
std::vector<ImageTriangle> project_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                           SurfaceModel model, const Executor& executor);

}  // namespace lensforge
