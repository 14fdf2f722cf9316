// SPDX-License-Identifier: GPL-3.0-or-later
// The whole finishing raster with its certificate, ball of 0.2 mm, stepover 0.06 mm, on a lens of
// 942,080 triangles: 641 × 737 vertices, 100 × 100 mm.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <Eigen/Geometry>
#include <cstdint>

#include "cam/cam_meshes.h"
#include "cam/contact/drop_curve.h"
#include "cam/path/finish_raster.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;

const SurfaceMesh& lens_mesh() {
  static const SurfaceMesh mesh = testing::grid_mesh(641, 737, 100.0, 100.0, testing::lens_relief);
  return mesh;
}

RasterPlan lens_plan(bool arcs) {
  const Eigen::AlignedBox2d surface(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(100.0, 100.0));
  RasterOptions options;
  options.arcs = arcs;
  return plan_finish_raster(surface, kRadius, options);
}

/// Gouge, excess and peak memory are what was reached, not what is allowed.
void tell(const RasterSummary& summary, const SurfaceDeviation& deviation,
          benchmark::State& state) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["moves"] = static_cast<double>(summary.points);
  state.counters["arcs"] = static_cast<double>(summary.arcs);
  state.counters["pieces"] = static_cast<double>(summary.pieces);
  state.counters["gouge_nm"] = 1e6 * summary.certificate.gouge.value;
  state.counters["excess_nm"] = 1e6 * summary.certificate.excess.value;
  state.counters["slope_mrad"] = 1e3 * summary.certificate.slope.value;
  state.counters["deviation_nm"] = 1e6 * deviation.height;
  state.counters["slope_deviation_mrad"] = 1e3 * deviation.slope;
  state.counters["peak_MB"] = static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void FinishFacets(benchmark::State& state) {
  const auto executor = Executor::cpu(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const FacetSurface surface(lens_mesh(), kRadius, executor);
    const RasterSummary summary =
        cut_raster(surface, lens_plan(state.range(1) != 0), executor, [](const RasterRow&) {}, {});
    tell(summary, surface.deviation(), state);
  }
}
BENCHMARK(FinishFacets)
    ->ArgNames({"threads", "arcs"})
    ->Args({2, 0})
    ->Args({2, 1})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kSecond);

void FinishSmooth(benchmark::State& state) {
  const auto executor = Executor::cpu(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const SmoothCutSurface surface(lens_mesh(), kRadius, {}, executor);
    const RasterSummary summary =
        cut_raster(surface, lens_plan(state.range(1) != 0), executor, [](const RasterRow&) {}, {});
    tell(summary, surface.deviation(), state);
    state.counters["facets"] = static_cast<double>(surface.facet_count());
  }
}
BENCHMARK(FinishSmooth)
    ->ArgNames({"threads", "arcs"})
    ->Args({2, 1})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kSecond);

/// The exact drop curve along rows through the middle of the lens.
void DropCurveRows(benchmark::State& state) {
  const DropCutter cutter(lens_mesh(), kRadius, Executor::cpu());
  std::int64_t row = 0;
  std::int64_t pieces = 0;
  for (auto _ : state) {
    const double y = 40.0 + 0.06 * static_cast<double>(row++ % 100);
    pieces += static_cast<std::int64_t>(drop_curve(cutter, {0, y}, 0.0, 100.0).size());
  }
  state.SetItemsProcessed(pieces);
}
BENCHMARK(DropCurveRows)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lensforge
