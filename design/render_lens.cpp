// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render_lens.h"

#include <numeric>
#include <span>
#include <vector>

#include "design/render_flux.h"

namespace lensforge {

namespace {

Image scaled(std::span<const double> flux, int columns, int rows, double factor) {
  Image image(columns, rows);
  for (std::size_t i = 0; i < flux.size(); ++i) {
    image.values()[i] = static_cast<float>(flux[i] * factor);
  }
  return image;
}

std::vector<double> flux_of(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                            const Executor& executor) {
#if defined(LENSFORGE_CUDA)
  if (executor.device() == Device::kCuda) return render_flux_cuda(mesh, setup, model, executor);
#endif
  return render_flux(mesh, setup, model, executor);
}

RenderResult render_scaled(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                           double total, const Executor& executor) {
  const std::vector<double> flux = flux_of(mesh, setup, model, executor);
  return {scaled(flux, setup.pixels.x(), setup.pixels.y(), total),
          std::accumulate(flux.begin(), flux.end(), 0.0)};
}

}  // namespace

RenderResult render_surface(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                            const Executor& executor) {
  const double pixels = static_cast<double>(setup.pixels.x()) * setup.pixels.y();
  return render_scaled(mesh, setup, model, pixels, executor);
}

ImageMetrics evaluate(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                      const Image& target, Image* rendered, const Executor& executor) {
  RenderResult result = render_scaled(mesh, setup, model, target.total(), executor);
  ImageMetrics metrics = compare(result.image, target);
  metrics.flux_inside = result.flux_inside;
  if (rendered != nullptr) *rendered = std::move(result.image);
  return metrics;
}

}  // namespace lensforge
