// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_spline.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "core/surface/lit_surface.h"
#include "design/flux/flux_image.h"
#include "design/optics/surface_kernels.h"

namespace lensforge {
namespace {

/// Rows of triangles that are looked at together: four million nodes have 63 strips.
constexpr int kStripRows = 32;

class Strips {
 public:
  explicit Strips(const ControlNet& net)
      : net_(net), samples_(picture_samples(net)), rows_(samples_ * net.cells().y()) {}

  [[nodiscard]] int count() const { return (rows_ + kStripRows - 1) / kStripRows; }
  [[nodiscard]] SampledSurface strip(int k) const {
    const int first = k * kStripRows;
    return spline_rows(net_, samples_, first, std::min(first + kStripRows, rows_));
  }
  /// light_on() of all.
  [[nodiscard]] LightPath light(const OpticalSetup& setup) const {
    const LightPath light(setup);
    if (light.intake_is_plan_area()) return light;
    double intake = 0.0;
    for (int k = 0; k < count(); ++k) intake += intake_of(strip(k).mesh, light);
    return light.sharing(intake);
  }

 private:
  const ControlNet& net_;
  int samples_;
  int rows_;
};

void add(const SampledSurface& strip, const LightPath& light, const FluxAccumulator& picture) {
  const SurfaceMesh& mesh = strip.mesh;
  const SurfaceView surface{mesh.triangles.data(), mesh.vertices.data(), light};
  Eigen::Matrix2Xd landing(2, mesh.vertex_count());
  const LandRay land{surface, strip.normals.data(), landing.data()};
  for (std::int64_t v = 0; v < mesh.vertex_count(); ++v) land(v);
  const ProjectSmooth project{surface, landing.data()};
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) deposit(project(t), picture);
}

}  // namespace

std::vector<double> render_spline(const ControlNet& net, const OpticalSetup& setup,
                                  const Executor& executor) {
  const Strips strips(net);
  const LightPath light = strips.light(setup);
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
