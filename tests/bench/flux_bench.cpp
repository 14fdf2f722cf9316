// SPDX-License-Identifier: GPL-3.0-or-later
// Rendering a lens and its gradient. Names read forward/TRIANGLE-COLUMNS/PIXELS/THREADS, and those
// that compare kinds of light light/MODEL/WHOLE/KIND: --benchmark_filter=light/
// --benchmark_enable_random_interleaving=true --benchmark_repetitions=9.
#include <benchmark/benchmark.h>

#include <cmath>
#include <map>
#include <string>

#include "bench/lens_scene.h"
#include "core/compute/executor.h"
#include "core/optics/front.h"
#include "core/optics/light_path.h"
#include "design/energy/objective.h"
#include "design/flux/flux_image.h"
#include "design/render/render_flux.h"

namespace lensforge::bench {
namespace {

/// The paper's finest mesh and its halves and doubles: columns × 1.15 rows.
GridShape grid_of(std::int64_t columns) {
  return {static_cast<int>(columns) + 1, static_cast<int>(columns * 115 / 100) + 1};
}

void count_triangles(benchmark::State& state, const SurfaceMesh& mesh) {
  state.SetItemsProcessed(state.iterations() * mesh.triangle_count());
}

/// Image triangles in memory → picture.
void deposit_triangles(benchmark::State& state) {
  const SurfaceMesh mesh = lens_like_mesh(grid_of(state.range(0)));
  const int pixels = static_cast<int>(state.range(1));
  const Executor executor = Executor::cpu(static_cast<int>(state.range(2)));
  const auto triangles = project_surface(mesh, paper_setup(pixels), SurfaceModel::kFacet, executor);
  FluxImage image(pixels, pixels);
  for (auto _ : state) benchmark::DoNotOptimize(image.render(executor, triangles).data());
  count_triangles(state, mesh);
}

/// Size of a run and what is asked of it.
struct Run {
  std::int64_t columns;  ///< Of triangles.
  int threads;
  SurfaceModel model = SurfaceModel::kFacet;
  ObjectiveWeights weights{};
};

/// Surface → picture → picture error → gradient by all vertices, and the time of each step.
void objective(benchmark::State& state, const OpticalSetup& setup, const Run& run) {
  const SurfaceMesh mesh = lens_like_mesh(grid_of(run.columns));
  KernelProfile profile;
  const Executor executor = Executor::cpu(run.threads).with_profile(&profile);
  ObjectiveOptions options;
  options.model = run.model;
  options.weights = run.weights;
  options.area = default_area_barrier(setup, mesh.triangle_count());
  DesignObjective function(mesh, setup, grey_scene(setup.pixels.x()), options, executor);
  Eigen::Matrix3Xd gradient;
  profile.clear();
  for (auto _ : state) {
    benchmark::DoNotOptimize(function.evaluate(mesh.vertices, gradient).energy.total);
  }
  for (const auto& [kernel, entry] : profile.entries()) {
    state.counters["ms_" + kernel] = 1e3 * entry.seconds / static_cast<double>(state.iterations());
  }
  count_triangles(state, mesh);
}

void objective(benchmark::State& state, const ObjectiveWeights& weights) {
  Run run{state.range(0), static_cast<int>(state.range(2))};
  run.weights = weights;
  objective(state, paper_setup(static_cast<int>(state.range(1))), run);
}

ObjectiveWeights picture_only() {
  ObjectiveWeights weights;
  weights.smooth = 0.0;
  return weights;
}

void forward_and_gradient(benchmark::State& state) { objective(state, picture_only()); }

void whole_objective(benchmark::State& state) { objective(state, ObjectiveWeights{}); }

/// Kinds of light.
enum Kind : std::uint8_t { kAlongZ, kPoint, kMirror, kPointOnMirror, kCurvedFront, kKinds };

OpticalSetup setup_of(std::int64_t kind, int pixels) {
  OpticalSetup setup = paper_setup(pixels);
  if (kind == kMirror || kind == kPointOnMirror) setup.body = MirrorBody{};
  if (kind == kMirror) setup.lamp = ParallelLight{{0.5, 0.0, -std::sqrt(0.75)}};
  if (kind == kPoint) setup.lamp = PointSource{{50.0, 50.0, -600.0}};
  if (kind == kPointOnMirror) setup.lamp = PointSource{{-87.0, 50.0, 150.0}};
  if (kind == kCurvedFront) setup.front = spherical_front(500.0, setup.lens_size);
  // A picture that the light of a flat surface fills, as that of a design does.
  const LightPath light(setup);
  const Eigen::Vector2d middle = 0.5 * setup.lens_size;
  const auto lands = [&](double x, double y) -> Eigen::Vector2d {
    return light.plane().to_mm(light.land_from_start({middle.x() + x, middle.y() + y, 5.0}));
  };
  setup.image_size *= lands(1.0, 0.0).x() - lands(0.0, 0.0).x();
  setup.image_origin = lands(0.0, 0.0) - 0.5 * setup.image_size;
  return setup;
}

/// The same lens in one kind of light after the other, on one thread.
void light(benchmark::State& state) {
  Run run{160, 1, state.range(0) == 0 ? SurfaceModel::kFacet : SurfaceModel::kSmooth};
  if (state.range(1) == 0) run.weights = picture_only();
  objective(state, setup_of(state.range(2), 128), run);
}

void kinds(benchmark::internal::Benchmark* bench) {
  bench->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
  bench->ArgNames({"smooth", "whole", "kind"});
  bench->ArgsProduct({{0, 1}, {0, 1}, benchmark::CreateDenseRange(0, kKinds - 1, 1)});
}

/// Paper size on 1 and 2 threads, then meshes that grow with the picture from 64² to 1024².
void sizes(benchmark::internal::Benchmark* bench) {
  bench->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
  bench->Args({640, 512, 1})->Args({640, 512, 2});
  for (const int pixels : {64, 128, 256, 1024}) bench->Args({pixels * 5 / 4, pixels, 2});
}

BENCHMARK(deposit_triangles)->Apply(sizes);
BENCHMARK(forward_and_gradient)->Apply(sizes);
BENCHMARK(whole_objective)->Apply(sizes);
BENCHMARK(light)->Apply(kinds);

}  // namespace
}  // namespace lensforge::bench
