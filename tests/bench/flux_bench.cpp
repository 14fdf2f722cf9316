// SPDX-License-Identifier: GPL-3.0-or-later
// Rendering a lens and its gradient. Names read forward/TRIANGLE-COLUMNS/PIXELS/THREADS.
#include <benchmark/benchmark.h>

#include <map>
#include <string>

#include "bench/lens_scene.h"
#include "core/compute/executor.h"
#include "design/energy/objective.h"
#include "design/flux/flux_image.h"
#include "design/optics/surface_optics.h"

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

/// Surface → picture → picture error → gradient by all vertices, and the time of each step.
void objective(benchmark::State& state, const ObjectiveWeights& weights) {
  const SurfaceMesh mesh = lens_like_mesh(grid_of(state.range(0)));
  const int pixels = static_cast<int>(state.range(1));
  KernelProfile profile;
  const Executor executor = Executor::cpu(static_cast<int>(state.range(2))).with_profile(&profile);
  ObjectiveOptions options;
  options.weights = weights;
  options.area = default_area_barrier(paper_setup(pixels), mesh.triangle_count());
  DesignObjective function(mesh, paper_setup(pixels), grey_scene(pixels), options, executor);
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

void forward_and_gradient(benchmark::State& state) {
  ObjectiveWeights picture_only{};
  picture_only.smooth = 0.0;
  objective(state, picture_only);
}

void whole_objective(benchmark::State& state) { objective(state, ObjectiveWeights{}); }

/// Paper size on 1 and 2 threads, then meshes that grow with the picture from 64² to 1024².
void sizes(benchmark::internal::Benchmark* bench) {
  bench->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
  bench->Args({640, 512, 1})->Args({640, 512, 2});
  for (const int pixels : {64, 128, 256, 1024}) bench->Args({pixels * 5 / 4, pixels, 2});
}

BENCHMARK(deposit_triangles)->Apply(sizes);
BENCHMARK(forward_and_gradient)->Apply(sizes);
BENCHMARK(whole_objective)->Apply(sizes);

}  // namespace
}  // namespace lensforge::bench
