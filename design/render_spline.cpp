// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_spline.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/surface/lit_surface.h"
#include "core/surface/mesh_cut.h"
#include "design/flux/flux_image.h"
#include "design/flux/surface_projection.h"

namespace lensforge {
namespace {

/// Rows of triangles that are looked at together: four million nodes have 63 strips.
constexpr int kStripRows = 32;

class Strips {
 public:
  Strips(const ControlNet& net, int samples, const OpticalSetup& setup)
      : net_(net), setup_(setup), samples_(samples), rows_(samples_ * net.cells().y()) {}

  [[nodiscard]] int count() const { return (rows_ + kStripRows - 1) / kStripRows; }
  [[nodiscard]] SampledSurface strip(int k) const {
    const int first = k * kStripRows;
    SampledSurface rows = spline_rows(net_, samples_, first, std::min(first + kStripRows, rows_));
    if (!setup_.outline) return rows;
    return part_inside(rows.mesh, rows.normals,
                       cut_mesh(rows.mesh, *setup_.outline, Executor::serial()));
  }
  /// light_on() of all.
  [[nodiscard]] LightPath light() const {
    const LightPath light(setup_);
    if (light.intake_is_plan_area()) return light;
    double intake = 0.0;
    for (int k = 0; k < count(); ++k) intake += intake_of(strip(k).mesh, light);
    return light.sharing(intake);
  }

 private:
  const ControlNet& net_;
  const OpticalSetup& setup_;
  int samples_;
  int rows_;
};

void add(const SampledSurface& strip, const LightPath& light, const FluxAccumulator& picture) {
  const SurfaceMesh& mesh = strip.mesh;
  std::vector<IncidentRay> rays;
  const SurfaceView surface{
      mesh.triangles.data(), mesh.vertices.data(), light,
      find_rays(Executor::serial(), light, mesh.vertices.data(), mesh.vertex_count(), rays)};
  Eigen::Matrix2Xd landing(2, mesh.vertex_count());
  const LandRay land{surface, strip.normals.data(), landing.data()};
  for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) land(v);
  const ProjectSmooth project{surface, landing.data()};
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) deposit(project(t), picture);
}

}  // namespace

std::vector<double> render_spline(const ControlNet& net, const OpticalSetup& setup,
                                  const Executor& executor) {
  return render_spline(net, picture_samples(net), setup, executor);
}

std::vector<double> render_spline(const ControlNet& net, int samples, const OpticalSetup& setup,
                                  const Executor& executor) {
  const Strips strips(net, samples, setup);
  const LightPath light = strips.light();
  FluxImage image(setup.pixels.x(), setup.pixels.y());
  image.begin(executor);
  const auto add_strip = [&](std::int64_t k, const FluxAccumulator& picture) {
    add(strips.strip(static_cast<int>(k)), light, picture);
  };
  image.add(executor, strips.count(), add_strip, 1);
  const std::span<const double> flux = image.resolve(executor);
  return {flux.begin(), flux.end()};
}

}  // namespace lensforge
