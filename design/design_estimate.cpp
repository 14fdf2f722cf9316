// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_estimate.h"

#include <algorithm>

#include "core/surface/control_net.h"
#include "design/schedule/level_plan.h"

namespace lensforge {
namespace {

/// Processor seconds for a triangle, of an iteration of both models at 128² to 512² (1.6e-6 to
/// 2.1e-6 on 2 GHz cores), and of its transport onto a photograph (9e-5; black takes ten times
/// that).
constexpr double kIterationSeconds = 2e-6;
constexpr double kTransportSeconds = 1e-4;

/// Bytes for a triangle, at the peak of a 942,080-triangle design (1.8 GB), and of what is written:
/// surface and checkpoint, each twice while it is replaced.
constexpr double kTriangleMemory = 2000.0;
constexpr double kTriangleDisk = 120.0;

/// Bytes for a pixel of the working picture: PNG, EXR and double copies.
constexpr double kPixelMemory = 100.0;
constexpr double kPixelDisk = 30.0;

/// Of the program itself with its libraries.
constexpr double kBaseMemory = 1e8;

/// For a pixel of a rendering, and of the lens that is rendered: 4096 and 8192 pixels a side take
/// 0.58 and 1.87 GB, and at most 40 s.
constexpr double kRenderedSeconds = 6e-7;
constexpr double kRenderedMemory = 45.0;
constexpr double kRenderedDisk = 4.0;
constexpr double kRenderedBase = 1.5e8;

}  // namespace

WorkEstimate estimate_design(int columns, int rows, const DesignOptions& options, int threads) {
  WorkEstimate estimate;
  double processor = 0.0;
  for (const Level& level : plan_levels(working_size(columns, rows, options.pixels), options)) {
    const double per_cell = level.spline ? 2.0 * kMeshSamples * kMeshSamples : 2.0;
    const double triangles = per_cell * (level.grid.columns - 1.0) * (level.grid.rows - 1.0);
    const double pixels = level.pixels.cast<double>().prod();
    const double iterations = static_cast<double>(level.rounds) * level.iterations;
    const int transports = level.spline ? 0 : options.transport_rounds;
    processor += triangles * (kTransportSeconds * transports +
                              kIterationSeconds * (options.rendering_guided ? iterations : 0.0));
    estimate.memory_bytes = kBaseMemory + kTriangleMemory * triangles + kPixelMemory * pixels;
    estimate.disk_bytes = kTriangleDisk * triangles + kPixelDisk * pixels;
  }
  estimate.seconds = processor / threads;
  return estimate;
}

WorkEstimate require_room_for_design(int columns, int rows, const DesignOptions& options,
                                     int threads, const std::filesystem::path& folder) {
  const auto work = [&](double pixels) {
    DesignOptions sized = options;
    sized.pixels = std::max(kMinPixels, static_cast<int>(pixels));
    return estimate_design(columns, rows, sized, threads);
  };
  return require_room_for(work, {"--pixels", 1.0 * options.pixels, kMinPixels}, folder);
}

WorkEstimate rendering_work(double pixels) {
  return {.seconds = kRenderedSeconds * pixels,
          .disk_bytes = kRenderedDisk * pixels,
          .memory_bytes = kRenderedBase + kRenderedMemory * pixels};
}

}  // namespace lensforge
