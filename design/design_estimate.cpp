// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_estimate.h"

#include <string>

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
  const double memory = free_memory_bytes();
  const double disk = free_disk_bytes(folder);
  const auto fits = [&](int pixels) {
    DesignOptions smaller = options;
    smaller.pixels = pixels;
    const WorkEstimate needed = estimate_design(columns, rows, smaller, threads);
    return needed.memory_bytes <= memory && needed.disk_bytes <= disk;
  };
  int pixels = options.pixels;
  while (pixels > kMinPixels && !fits(pixels)) pixels = pixels * 9 / 10;
  const WorkEstimate expected = estimate_design(columns, rows, options, threads);
  require_room(expected, folder, "--pixels " + std::to_string(options.pixels),
               "--pixels " + std::to_string(pixels) + " would fit");
  return expected;
}

}  // namespace lensforge
