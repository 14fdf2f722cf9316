// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_estimate.h"

#include <algorithm>
#include <cstddef>

#include "core/surface/control_net.h"
#include "design/schedule/levels.h"
#include "design/schedule/rounds.h"

namespace lensforge {
namespace {

/// Processor seconds for a triangle, on 2 GHz cores: of an iteration of facets and smooth model at
/// 256² and 512² (5.0e-7 to 5.5e-7), of one of a spline, a triangle being one between nodes (96²
/// and 128²), of one designed for a process (64² and 128²), and of its transport with the mesh's
/// start (5e-5 to 8e-5; facets have two).
constexpr double kIterationSeconds = 5.1e-7;
constexpr double kSplineSeconds = 2.5e-7;
constexpr double kMadeSeconds = 1e-6;
constexpr double kTransportSeconds = 6e-5;

/// Bytes for a triangle: of its transport, of the optimisation of a mesh (512², 1.12 GB) and of a
/// spline (128², 0.57 GB), and of what is written: surface and checkpoint, each twice while it is
/// replaced.
constexpr double kTransportMemory = 2000.0;
constexpr double kMeshMemory = 1000.0;
constexpr double kSplineMemory = 500.0;
constexpr double kTriangleDisk = 120.0;
/// What rank 0 of several machines has of the whole mesh (docs/scale.md).
constexpr double kWholeMemory = 200.0;

/// Bytes for a pixel of the working picture: PNG, EXR and double copies.
constexpr double kPixelMemory = 100.0;
constexpr double kPixelDisk = 30.0;

/// Of the program itself with its libraries.
constexpr double kBaseMemory = 1.6e8;

/// For a pixel of a rendering, and of the lens that is rendered: 4096 and 8192 pixels a side take
/// 0.58 and 1.87 GB, and at most 40 s.
constexpr double kRenderedSeconds = 6e-7;
constexpr double kRenderedMemory = 45.0;
constexpr double kRenderedDisk = 4.0;
constexpr double kRenderedBase = 1.5e8;

/// What each further wavelength adds to an iteration: 64² portrait and logo, smooth, whole designs
/// for one and three of them 5.9 and 9.5 s, 7.0 and 10.8 s.
constexpr double kColorShare = 0.35;

double iteration_seconds(const Level& level, const DesignOptions& options) {
  const std::size_t colors = std::max<std::size_t>(1, options.light.spectrum.wavelengths.size());
  const double growth = 1.0 + kColorShare * (static_cast<double>(colors) - 1.0);
  if (!level.spline) return growth * kIterationSeconds;
  return growth * (options.made_by ? kMadeSeconds : kSplineSeconds);
}

/// Sites of a level's transports: of the even mesh, and of facets' own.
double transport_sites(double triangles, const DesignOptions& options) {
  const double even = std::min(triangles, kMaxEvenFaces);
  return options.model == SurfaceModel::kFacet ? even + triangles : even;
}

}  // namespace

WorkEstimate estimate_design(int columns, int rows, const DesignOptions& options, int threads,
                             double share) {
  WorkEstimate estimate;
  double processor = 0.0;
  for (const Level& level : plan_levels(working_size(columns, rows, options.pixels), options)) {
    const double per_cell = level.spline ? 2.0 * kMeshSamples * kMeshSamples : 2.0;
    const double triangles = per_cell * (level.grid.columns - 1.0) * (level.grid.rows - 1.0);
    const double pixels = level.pixels.cast<double>().prod();
    const double iterations = static_cast<double>(level.rounds) * level.iterations;
    double memory = kSplineMemory * triangles;
    const double whole = share < 1.0 ? kWholeMemory : 0.0;
    if (options.rendering_guided) {
      processor += triangles * iteration_seconds(level, options) * iterations;
    }
    if (!level.spline) {
      const double sites = transport_sites(triangles, options);
      processor += kTransportSeconds * sites * options.transport_rounds;
      memory = std::max(kTransportMemory * std::min(sites, triangles),
                        (share * kMeshMemory + whole) * triangles);
    }
    estimate.memory_bytes = kBaseMemory + memory + kPixelMemory * pixels;
    estimate.disk_bytes = kTriangleDisk * triangles + kPixelDisk * pixels;
  }
  estimate.seconds = processor / threads;
  return estimate;
}

WorkEstimate require_room_for_design(int columns, int rows, const DesignOptions& options,
                                     int threads, const std::filesystem::path& folder,
                                     double share) {
  const auto work = [&](double pixels) {
    DesignOptions sized = options;
    sized.pixels = std::max(kMinPixels, static_cast<int>(pixels));
    return estimate_design(columns, rows, sized, threads, share);
  };
  return require_room_for(work, {"--pixels", 1.0 * options.pixels, kMinPixels}, folder);
}

WorkEstimate rendering_work(double pixels) {
  return {.seconds = kRenderedSeconds * pixels,
          .disk_bytes = kRenderedDisk * pixels,
          .memory_bytes = kRenderedBase + kRenderedMemory * pixels};
}

}  // namespace lensforge
