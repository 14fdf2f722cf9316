// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/optics/outline.h"
#include "core/text/number_text.h"
#include "design/render/render_flux.h"
#include "design/render/source_picture.h"

namespace lensforge {
namespace {

/// Cost per pixel of a rendering, and memory for the rendered lens: 8192 pixels a side take 1.87 GB
/// and at most 40 s.
constexpr double kRenderedSeconds = 6e-7;
constexpr double kRenderedMemory = 45.0;
constexpr double kRenderedDisk = 4.0;
constexpr double kRenderedBase = 1.5e8;

Image scaled(std::span<const double> flux, int columns, int rows, double factor) {
  Image image(columns, rows);
  for (std::size_t i = 0; i < flux.size(); ++i) {
    image.values()[i] = static_cast<float>(flux[i] * factor);
  }
  return image;
}

std::vector<double> flux_of_point(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                  SurfaceModel model, const Executor& executor) {
#if defined(LENSFORGE_CUDA)
  if (executor.device() == Device::kCuda) return render_flux_cuda(mesh, setup, model, executor);
#endif
  return render_flux(mesh, setup, model, executor);
}

/// The part of a surface inside the outline.
SampledSurface lit_part(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                        const OpticalSetup& setup, const Executor& executor) {
  return part_inside(mesh, normals, cut_mesh(mesh, *setup.outline, executor));
}

int points_for(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  return source_point_count(setup, mesh.vertices.row(2).mean());
}

std::vector<double> flux_through(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                 SurfaceModel model, const Executor& executor) {
  return picture_under(setup, points_for(mesh, setup), [&](const OpticalSetup& point) {
    return flux_of_point(mesh, point, model, executor);
  });
}

/// With given normals.
std::vector<double> flux_through(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                                 const OpticalSetup& setup, const Executor& executor) {
  return picture_under(setup, points_for(mesh, setup), [&](const OpticalSetup& point) {
    return render_flux(mesh, point, SurfaceModel::kSmooth, executor, &normals);
  });
}

RenderResult result_of(const std::vector<double>& flux, const OpticalSetup& setup, double total) {
  return {scaled(flux, setup.pixels.x(), setup.pixels.y(), total),
          std::accumulate(flux.begin(), flux.end(), 0.0)};
}

/// Maximum number of nodes for Look::kBrief, over all points of a source: about 0.5 s on one
/// thread.
constexpr double kBriefNodes = 4e6;

constexpr int kBriefSamples = 4;  ///< Nodes per knot cell each way.
constexpr int kBriefPoints = 4;   ///< Minimum number of source points.

/// flux_of_lens() under one of its models at Look::kBrief.
std::vector<double> brief_flux(const Lens& lens, SurfaceModel model, const Executor& executor) {
  const bool spline = model == SurfaceModel::kSpline;
  const int samples = spline ? std::min(kBriefSamples, picture_samples(*lens.spline)) : 1;
  const double nodes = spline ? static_cast<double>(lens.spline->cell_count()) * samples * samples
                              : static_cast<double>(lens.surface.vertex_count());
  const int points = std::min(points_for(lens.surface, lens.setup),
                              std::max(kBriefPoints, static_cast<int>(kBriefNodes / nodes)));
  return picture_under(lens.setup, points, [&](const OpticalSetup& point) {
    if (spline) return render_spline(*lens.spline, samples, point, executor);
    return flux_of_surface(lens.surface, point, model, executor);
  });
}

double pixel_count(const OpticalSetup& setup) {
  return static_cast<double>(setup.pixels.x()) * setup.pixels.y();
}

ImageMetrics judged(RenderResult result, const Image& target, Image* rendered) {
  ImageMetrics metrics = compare(result.image, target);
  metrics.flux_inside = result.flux_inside;
  if (rendered != nullptr) *rendered = std::move(result.image);
  return metrics;
}

}  // namespace

std::vector<double> flux_of_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                    SurfaceModel model, const Executor& executor) {
  if (!setup.outline) return flux_through(mesh, setup, model, executor);
  const SampledSurface part = lit_part(mesh, vertex_area_normals(mesh), setup, executor);
  if (model == SurfaceModel::kFacet) return flux_through(part.mesh, setup, model, executor);
  return flux_through(part.mesh, part.normals, setup, executor);
}

std::vector<double> flux_of_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                                    const OpticalSetup& setup, const Executor& executor) {
  if (!setup.outline) return flux_through(mesh, normals, setup, executor);
  const SampledSurface part = lit_part(mesh, normals, setup, executor);
  return flux_through(part.mesh, part.normals, setup, executor);
}

RenderResult render_surface(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                            const Executor& executor) {
  return result_of(flux_of_surface(mesh, setup, model, executor), setup, pixel_count(setup));
}

RenderResult render_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const OpticalSetup& setup, const Executor& executor) {
  return result_of(flux_of_surface(mesh, normals, setup, executor), setup, pixel_count(setup));
}

ImageMetrics evaluate(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                      const Image& target, Image* rendered, const Executor& executor) {
  return judged(result_of(flux_of_surface(mesh, setup, model, executor), setup, target.total()),
                target, rendered);
}

ImageMetrics evaluate(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                      const OpticalSetup& setup, const Image& target, Image* rendered,
                      const Executor& executor) {
  return judged(result_of(flux_of_surface(mesh, normals, setup, executor), setup, target.total()),
                target, rendered);
}

std::vector<double> flux_of_lens(const Lens& lens, const OpticalSetup& setup,
                                 const Executor& executor, const RunControl& control) {
  if (lens.model != SurfaceModel::kSpline) {
    return flux_of_surface(lens.surface, setup, lens.model, executor);
  }
  return flux_under_source(lens, setup, points_for(lens.surface, setup), executor, control);
}

ImageMetrics evaluate(const Lens& lens, SurfaceModel model, Image* rendered,
                      const Executor& executor, Look look, const RunControl& control) {
  if (look == Look::kBrief) {
    return judged(result_of(brief_flux(lens, model, executor), lens.setup, lens.target.total()),
                  lens.target, rendered);
  }
  if (model != SurfaceModel::kSpline) {
    return evaluate(lens.surface, lens.setup, model, lens.target, rendered, executor);
  }
  return judged(
      result_of(flux_of_lens(lens, lens.setup, executor, control), lens.setup, lens.target.total()),
      lens.target, rendered);
}

Fringe fringe_of(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                 const OpticalSetup& setup) {
  const std::optional<OutlineIndex> outline =
      setup.outline ? std::optional<OutlineIndex>(*setup.outline) : std::nullopt;
  const LightPath first(in_color(setup, setup.spectrum.wavelengths.front()));
  const LightPath last(in_color(setup, setup.spectrum.wavelengths.back()));
  Fringe fringe;
  Eigen::Index count = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d p = mesh.vertices.col(v);
    const Eigen::Vector3d n = normals.col(v).normalized();
    if (outline && !outline->contains(p.head<2>())) continue;
    if (!first.transmits(p, n) || !last.transmits(p, n)) continue;
    const Eigen::Vector2d apart =
        first.land(p, first.beam(p, n).m) - last.land(p, last.beam(p, n).m);
    const double mm = apart.cwiseQuotient(first.plane().pixels_per_mm()).norm();
    fringe.mean += mm;
    fringe.max = std::max(fringe.max, mm);
    ++count;
  }
  if (count > 0) fringe.mean /= static_cast<double>(count);
  return fringe;
}

Fringe fringe_of(const Lens& lens) {
  if (lens.model == SurfaceModel::kSpline) {
    const SampledSurface nodes = picture_nodes(*lens.spline);
    return fringe_of(nodes.mesh, nodes.normals, lens.setup);
  }
  return fringe_of(lens.surface, vertex_area_normals(lens.surface), lens.setup);
}

OpticalSetup setup_for_mesh(const SurfaceMesh& mesh) {
  const Eigen::Vector2d low = mesh.vertices.topRows<2>().rowwise().minCoeff();
  const Eigen::Vector2d high = mesh.vertices.topRows<2>().rowwise().maxCoeff();
  OpticalSetup setup;
  setup.lens_size = high - low;
  setup.image_size = setup.lens_size;
  setup.image_origin = low;
  return with_longer_side(setup, OpticalSetup{}.pixels.maxCoeff());
}

OpticalSetup with_longer_side(OpticalSetup setup, int pixels) {
  const Eigen::Vector2d shape = setup.image_size / setup.image_size.maxCoeff() * pixels;
  setup.pixels.x() = std::max(1, static_cast<int>(std::lround(shape.x())));
  setup.pixels.y() = std::max(1, static_cast<int>(std::lround(shape.y())));
  return setup;
}

OpticalSetup with_image_width(OpticalSetup setup, double width) {
  const Eigen::Vector2d size = setup.image_size * (width / setup.image_size.x());
  setup.image_origin += 0.5 * (setup.image_size - size);
  setup.image_size = size;
  return setup;
}

void require_wall_above(const SurfaceMesh& mesh, const OpticalSetup& setup,
                        const std::string& option) {
  validate(setup);
  const LightPath light(setup);
  double clearance = std::numeric_limits<double>::infinity();
  for (const auto& p : mesh.vertices.colwise()) {
    clearance = std::min(clearance, light.clearance(p));
  }
  if (clearance > 0.0) return;
  // Per mm along z, the screen's distance grows by its normal's z.
  const double steepness = setup.screen_x.cross(setup.screen_y).z();
  throw InputError(option + " " + number_text(setup.focal_length) +
                   ": the wall must stand above the whole surface, beyond " +
                   number_text(setup.focal_length - clearance / steepness) + " mm");
}

WorkEstimate rendering_work(double pixels) {
  return {.seconds = kRenderedSeconds * pixels,
          .disk_bytes = kRenderedDisk * pixels,
          .memory_bytes = kRenderedBase + kRenderedMemory * pixels};
}

}  // namespace lensforge
