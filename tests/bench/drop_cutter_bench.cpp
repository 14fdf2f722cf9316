// SPDX-License-Identifier: GPL-3.0-or-later
// Drop-cutter, ball of 0.2 mm, on a lens of 942,080 triangles: 641 × 737 vertices, 100 × 100 mm.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/contact/drop_cutter.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;
constexpr double kPitch = 0.06;
constexpr double kSpacing = 0.008;

const SurfaceMesh& lens_mesh() {
  static const SurfaceMesh mesh = testing::grid_mesh(641, 737, 100.0, 100.0, testing::lens_relief);
  return mesh;
}

const DropCutter& lens_cutter() {
  static const DropCutter cutter(lens_mesh(), kRadius, Executor::cpu());
  return cutter;
}

/// Rows of a finishing raster through the middle of the lens.
std::vector<Eigen::Vector2d> raster_points(int rows) {
  std::vector<Eigen::Vector2d> points;
  for (int r = 0; r < rows; ++r) {
    for (int i = 0; i <= static_cast<int>(100.0 / kSpacing); ++i) {
      points.emplace_back(i * kSpacing, 40.0 + r * kPitch);
    }
  }
  return points;
}

/// Points in no order at all (a Weyl sequence).
std::vector<Eigen::Vector2d> scattered_points(std::int64_t count) {
  std::vector<Eigen::Vector2d> points;
  for (std::int64_t i = 0; i < count; ++i) {
    const auto n = static_cast<double>(i);
    points.emplace_back(100.0 * std::fmod(n * 0.7548776662466927, 1.0),
                        100.0 * std::fmod(n * 0.5698402909980532, 1.0));
  }
  return points;
}

void run_drop(benchmark::State& state, const std::vector<Eigen::Vector2d>& points) {
  const auto executor = Executor::cpu(static_cast<int>(state.range(0)));
  const DropCutter& cutter = lens_cutter();
  std::vector<CutterLocation> locations(points.size());
  for (auto _ : state) {
    cutter.drop(points, locations, executor);
    benchmark::DoNotOptimize(locations.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points.size()));
}

void DropCutterRaster(benchmark::State& state) { run_drop(state, raster_points(20)); }
BENCHMARK(DropCutterRaster)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

void DropCutterScattered(benchmark::State& state) { run_drop(state, scattered_points(200'000)); }
BENCHMARK(DropCutterScattered)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

/// Minimum work: contact with one known facet per point. The ratio of DropCutterRaster's rate to
/// this one shows the cost of finding the facet.
void OneFacetPerPoint(benchmark::State& state) {
  const SurfaceMesh& mesh = lens_mesh();
  std::vector<FacetContact> facets;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    facets.push_back(
        make_facet_contact(kRadius, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)));
  }
  const std::vector<Eigen::Vector2d> points = raster_points(20);
  std::vector<CutterLocation> locations(points.size());
  lens_cutter().drop(points, locations, Executor::cpu());
  std::vector<double> tips(points.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const FacetContact& facet = facets[static_cast<std::size_t>(locations[i].triangle)];
      const bool inside = contact_point(facet, points[i]).inside();
      tips[i] = inside ? tangent_tip(facet, points[i]) : kNoContact;
    }
    benchmark::DoNotOptimize(tips.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points.size()));
}
BENCHMARK(OneFacetPerPoint);

void DropCutterBuild(benchmark::State& state) {
  const auto executor = Executor::cpu(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const DropCutter cutter(lens_mesh(), kRadius, executor);
    benchmark::DoNotOptimize(&cutter);
  }
  state.SetItemsProcessed(state.iterations() * lens_mesh().triangle_count());
}
BENCHMARK(DropCutterBuild)
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lensforge
