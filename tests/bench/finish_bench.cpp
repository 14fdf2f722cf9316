// SPDX-License-Identifier: GPL-3.0-or-later
// The finishing raster with its certificate, as cam cuts by default (ball of 0.2 mm, stepover
// 0.06 mm), on lenses of 100 × 100 mm: 641 × 737 vertices (942,080 triangles) or 321 × 369
// (235,520); and on a spline of 15 × 10 mm with what goes on around it.
#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>

#include "bench/process_usage.h"
#include "cam/cam_meshes.h"
#include "cam/contact/drop_curve.h"
#include "cam/path/finish_raster.h"
#include "core/lens/continued_surface.h"
#include "core/spline/sample_splines.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;
constexpr double kSide = 100.0;

/// What cam cuts: CutPlan's kSmoothCut.
constexpr SmoothCutOptions kSmoothCut{1e-4, 2e-2};

/// A lens of about `kilo_triangles` thousand triangles.
const SurfaceMesh& lens_mesh(std::int64_t kilo_triangles) {
  static const SurfaceMesh large = testing::grid_mesh(641, 737, kSide, kSide, testing::lens_relief);
  static const SurfaceMesh small = testing::grid_mesh(321, 369, kSide, kSide, testing::lens_relief);
  return kilo_triangles > 500 ? large : small;
}

/// Rows on a strip of `width` mm through the middle of the lens.
RasterPlan strip_plan(double width, bool arcs) {
  const double begin = 0.5 * (kSide - width);
  const Eigen::AlignedBox2d strip(Eigen::Vector2d(0.0, begin),
                                  Eigen::Vector2d(kSide, begin + width));
  RasterOptions options;
  options.arcs = arcs;
  options.slope_tolerance = FinishProcess{}.slope_tolerance;
  return plan_finish_raster(strip, kRadius, options);
}

/// Gouge, excess and peak memory are measured values, not limits.
void tell(const RasterSummary& summary, const SurfaceDeviation& deviation, double seconds,
          benchmark::State& state) {
  state.counters["cpu_s"] = seconds;
  state.counters["rows"] = static_cast<double>(summary.rows);
  state.counters["moves"] = static_cast<double>(summary.points);
  state.counters["arcs"] = static_cast<double>(summary.arcs);
  state.counters["pieces"] = static_cast<double>(summary.pieces);
  state.counters["cpu_us_per_move"] = 1e6 * seconds / static_cast<double>(summary.points);
  state.counters["gouge_nm"] = 1e6 * summary.certificate.gouge.value;
  state.counters["excess_nm"] = 1e6 * summary.certificate.excess.value;
  state.counters["slope_mrad"] = 1e3 * summary.certificate.slope.value;
  state.counters["slope_x"] = summary.certificate.slope.place.x();
  state.counters["slope_y"] = summary.certificate.slope.place.y();
  state.counters["deviation_nm"] = 1e6 * deviation.height;
  state.counters["slope_deviation_mrad"] = 1e3 * deviation.slope;
  state.counters["peak_MB"] = bench::peak_megabytes();
}

RasterSummary cut_strip(const CutSurface& surface, const benchmark::State& state,
                        const Executor& executor) {
  const RasterPlan plan = strip_plan(static_cast<double>(state.range(1)), state.range(2) != 0);
  return cut_raster(surface, plan, executor, [](const RasterRow&) {}, {});
}

void FinishFacets(benchmark::State& state) {
  const auto executor = Executor::cpu(2);
  const SurfaceMesh& mesh = lens_mesh(state.range(0));
  for (auto _ : state) {
    const double start = bench::cpu_seconds();
    const FacetCutSurface surface(mesh, kRadius, executor);
    const RasterSummary summary = cut_strip(surface, state, executor);
    tell(summary, surface.deviation(), bench::cpu_seconds() - start, state);
  }
}

void FinishSmooth(benchmark::State& state) {
  const auto executor = Executor::cpu(2);
  const SurfaceMesh& mesh = lens_mesh(state.range(0));
  for (auto _ : state) {
    const double start = bench::cpu_seconds();
    const SmoothCutSurface surface(mesh, kRadius, kSmoothCut, executor);
    const RasterSummary summary = cut_strip(surface, state, executor);
    tell(summary, surface.deviation(), bench::cpu_seconds() - start, state);
    state.counters["facets"] = static_cast<double>(surface.facet_count());
  }
}

/// A strip of 2 mm, and the whole lens.
void sizes(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"ktriangles", "mm", "arcs"});
  for (const std::int64_t kilo_triangles : {235, 942}) {
    for (const std::int64_t width : {2, 100}) bench->Args({kilo_triangles, width, 1});
  }
  bench->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);
}
BENCHMARK(FinishFacets)->Apply(sizes);
BENCHMARK(FinishSmooth)->Apply(sizes);

/// A spline with crowded knots at a corner and its continuation, where the ball follows facets
/// beyond the rim.
void FinishBeyondRim(benchmark::State& state) {
  constexpr double kApron = 0.4;
  const auto executor = Executor::cpu(2);
  const auto spline = std::make_shared<const SplineSurface>(testing::crowded_spline());
  for (auto _ : state) {
    const double start = bench::cpu_seconds();
    const SmoothCutSurface surface(continued_surface(spline, 2.0 * kApron, RunOut{}), kRadius,
                                   kSmoothCut, executor);
    RasterOptions options;
    options.apron = kApron;
    const RasterPlan plan = plan_finish_raster(spline->box(), kRadius, options);
    const RasterSummary summary = cut_raster(surface, plan, executor, [](const RasterRow&) {}, {});
    tell(summary, surface.deviation(), bench::cpu_seconds() - start, state);
    state.counters["facets"] = static_cast<double>(surface.facet_count());
  }
}
BENCHMARK(FinishBeyondRim)->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);

/// The exact drop curve along rows through the middle of the lens.
void DropCurveRows(benchmark::State& state) {
  const DropCutter cutter(lens_mesh(942), kRadius, Executor::cpu());
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
