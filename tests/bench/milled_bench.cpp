// SPDX-License-Identifier: GPL-3.0-or-later
// The surfaces that cutting leaves, nodes 10 µm apart, of a lens of 942,080 triangles: 641 × 737
// vertices, 100 × 100 mm, ball of 0.2 mm, rows 0.06 mm apart.
#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/contact/drop_cutter.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/polished_field.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled_paths.h"
#include "core/lens/continued_surface.h"
#include "core/lens/smooth_surface.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;
constexpr double kSide = 100.0;

const SurfaceMesh& lens_mesh() {
  static const SurfaceMesh mesh = testing::grid_mesh(641, 737, kSide, kSide, testing::lens_relief);
  return mesh;
}

const DropCutter& lens_cutter() {
  static const DropCutter cutter(lens_mesh(), kRadius, Executor::cpu());
  return cutter;
}

const FacetField& lens_facets() {
  static const FacetField field(lens_mesh());
  return field;
}

/// A raster of moves of 0.033 mm, five million.
const MilledField& milled_lens() {
  static const MilledField field = [] {
    std::vector<BallPath> paths;
    paths.push_back(testing::raster_path(lens_cutter(), kSide, 0.06, 0.033));
    return MilledField(std::move(paths), 10.0);
  }();
  return field;
}

/// Samples tiles of a square centimetre, each another one.
void run(benchmark::State& state, const SurfaceField& field) {
  const auto executor = Executor::cpu(static_cast<int>(state.range(0)));
  SurfacePatch patch;
  std::int64_t tile = 0;
  for (auto _ : state) {
    GridWindow window{{0.0, 0.0}, {0.01, 0.01}, 1001, 1001};
    window.first_column = tile * 37 % 90 * 100;
    window.first_row = tile * 53 % 90 * 100;
    ++tile;
    field.sample(window, executor, patch);
    benchmark::DoNotOptimize(patch.z.data());
  }
  state.SetItemsProcessed(state.iterations() * 1001 * 1001);
}

void DesignedNodes(benchmark::State& state) { run(state, lens_facets()); }
BENCHMARK(DesignedNodes)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

void MilledNodes(benchmark::State& state) { run(state, milled_lens()); }
BENCHMARK(MilledNodes)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

void RoundedNodes(benchmark::State& state) {
  static const RoundedField field(lens_facets(), lens_facets().grid(), lens_cutter(),
                                  Executor::cpu());
  run(state, field);
}
BENCHMARK(RoundedNodes)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

/// Of a smooth surface through the vertices.
void SmoothNodes(benchmark::State& state) {
  static const SmoothSurface surface(lens_mesh());
  static const SmoothField field(surface);
  run(state, field);
}
BENCHMARK(SmoothNodes)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

/// Cost of polishing in addition to the facets.
void PolishedNodes(benchmark::State& state) {
  const Eigen::AlignedBox2d lens(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kSide, kSide));
  static const auto apron =
      continued_surface(std::make_shared<const FacetSurface>(lens_mesh()), 0.5, RunOut{});
  static const FacetField facets(apron->mesh());
  const PolishedField field(facets, lens, {0.03, 0.0, 1.0});
  run(state, field);
}
BENCHMARK(PolishedNodes)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

}  // namespace
}  // namespace lensforge
