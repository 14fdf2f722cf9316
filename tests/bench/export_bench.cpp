// SPDX-License-Identifier: GPL-3.0-or-later
// Fitting, writing and reading back a solid of splines for lenses of 100 × 100 mm: the meshes of
// pictures of 128², 256² and 512². Tolerances that cannot hold make the fit use all its control
// points, as lenses with creases do.
#include <benchmark/benchmark.h>

#include <cstdint>

#include "bench/process_usage.h"
#include "cam/cam_meshes.h"
#include "core/lens/smooth_surface.h"
#include "core/temp_folder.h"
#include "export/solid/solid_files.h"
#include "export/spline/spline_fit.h"

namespace lensforge {
namespace {

constexpr double kSide = 100.0;

/// Grids that design chooses for square pictures of this many pixels a side.
GridShape grid_of(std::int64_t pixels) {
  const auto cells = static_cast<int>(5 * pixels / 4);
  return {cells + 1, cells * 23 / 20 + 1};
}

/// Memory is the largest of the process so far: run one size alone to judge it.
void tell(const SplineNet& net, const std::filesystem::path& file, double seconds,
          benchmark::State& state) {
  const FitError error = net.error();
  state.counters["cpu_s"] = seconds;
  state.counters["MB"] = 1e-6 * static_cast<double>(std::filesystem::file_size(file));
  state.counters["points"] = static_cast<double>(net.control_points());
  state.counters["patches"] = static_cast<double>(net.patches.size());
  state.counters["height_um"] = 1e3 * error.height;
  state.counters["normal_mrad"] = 1e3 * error.normal;
  state.counters["normal_rms_mrad"] = 1e3 * error.normal_rms;
  state.counters["peak_MB"] = bench::peak_megabytes();
}

void ExportStep(benchmark::State& state) {
  const GridShape grid = grid_of(state.range(0));
  const SurfaceMesh mesh =
      testing::grid_mesh(grid.columns, grid.rows, kSide, kSide, testing::lens_relief);
  const testing::TempFolder folder;
  const auto file = folder / "lens.step";
  FitOptions options;
  options.tolerance = 1e-9;
  options.normal_tolerance = 1e-9;
  for (auto _ : state) {
    const double start = bench::cpu_seconds();
    const SplineNet net =
        fit_spline_net(SmoothSurface(mesh), options, Executor::cpu(2), RunControl());
    write_step(net, {"lens", "", "", "lensforge", "2020-02-02T02:02:02"}, StepSchema::kAp214, file);
    tell(net, file, bench::cpu_seconds() - start, state);
  }
}
BENCHMARK(ExportStep)
    ->ArgName("pixels")
    ->Arg(128)
    ->Arg(256)
    ->Arg(512)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace lensforge
