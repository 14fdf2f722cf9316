// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "cam/cam_meshes.h"
#include "cam/milled/creases.h"
#include "cam/milled/mould.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled_paths.h"
#include "core/lens/surface_field.h"

namespace lensforge::milled_tiles_test {
namespace {

constexpr double kRadius = 0.2;

TEST(FieldTiles, EveryCellOfTheGridLiesInOneTile) {
  GridWindow grid = testing::window_at({0.0, 0.0}, 0.01, 83, 41);
  grid.first_column = 5;
  grid.first_row = 7;
  std::set<std::pair<std::int64_t, std::int64_t>> cells;
  std::int64_t count = 0;
  for (const CellRange& range : tiles_of(all_cells(grid), 16)) {
    const GridWindow tile = window_of(grid, range, 0);
    EXPECT_LE(tile.columns, 17);
    EXPECT_GE(tile.columns, 2);
    for (std::int64_t j = 0; j + 1 < tile.rows; ++j) {
      for (std::int64_t i = 0; i + 1 < tile.columns; ++i) {
        cells.emplace(tile.first_column + i, tile.first_row + j);
        ++count;
      }
    }
  }
  EXPECT_EQ(count, 82 * 40);
  EXPECT_EQ(static_cast<std::int64_t>(cells.size()), count);
  EXPECT_EQ(*cells.begin(), std::make_pair(std::int64_t{5}, std::int64_t{7}));
}

TEST(FieldTiles, MeshOfASampledMeshIsTheMesh) {
  const SurfaceMesh mesh = testing::grid_mesh(9, 7, 4.0, 3.0, testing::lens_relief);
  const SurfacePatch patch =
      testing::sampled(FacetField(mesh), testing::window_at({0.0, 0.0}, 0.5, 9, 7));
  const SurfaceMesh back = mesh_of(patch);
  EXPECT_EQ(back.triangles, mesh.triangles);
  EXPECT_EQ(back.grid, mesh.grid);
  EXPECT_LT((back.vertices - mesh.vertices).cwiseAbs().maxCoeff(), 1e-12);
}

/// Counts how often it is sampled.
class CountedField final : public SurfaceField {
 public:
  explicit CountedField(const SurfaceField& field) : field_(field) {}
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override {
    ++count;
    field_.sample(window, executor, patch);
  }
  mutable int count = 0;

 private:
  const SurfaceField& field_;
};

TEST(HeldField, GivesPartsOfWhatItHoldsAndSamplesOthers) {
  const SurfaceMesh mesh = testing::grid_mesh(9, 7, 4.0, 3.0, testing::lens_relief);
  const FacetField facets(mesh);
  const CountedField counted(facets);
  const HeldField held(counted);
  const GridWindow whole = testing::window_at({0.0, 0.0}, 0.1, 41, 31);
  GridWindow part = whole;
  part.first_column = 3;
  part.first_row = 5;
  part.columns = 11;
  part.rows = 26;
  const SurfacePatch all = testing::sampled(held, whole);
  const SurfacePatch some = testing::sampled(held, part);
  EXPECT_EQ(counted.count, 1);
  EXPECT_EQ(all.z, testing::sampled(facets, whole).z);
  const SurfacePatch own = testing::sampled(facets, part);
  EXPECT_EQ(some.z, own.z);
  EXPECT_EQ(some.slope_x, own.slope_x);
  EXPECT_EQ(some.slope_y, own.slope_y);
  EXPECT_EQ(some.cut, own.cut);
  GridWindow shifted = part;
  shifted.origin.x() = 0.05;
  EXPECT_EQ(testing::sampled(held, shifted).z, testing::sampled(facets, shifted).z);
  EXPECT_EQ(testing::sampled(held, whole).z, all.z);
  EXPECT_EQ(counted.count, 3);
}

/// Drawn from tiles with a node more around them, as pictures are rendered.
CreaseMap crease_map(const SurfaceField& field, const GridWindow& grid,
                     const CreaseMapOptions& options, std::int64_t side) {
  CreaseMapper mapper(grid, options);
  for (const CellRange& tile : tiles_of(all_cells(grid), side)) {
    mapper.add(tile, testing::sampled(field, window_of(grid, tile, 1)), Executor::cpu(2));
  }
  return mapper.map();
}

TEST(CreaseMap, FindsTheGroovesDepthWidthAndShare) {
  // Two grooves along y: at x = 1 with a turn of 2·atan(0.3), at x = 3 of 2·atan(0.1).
  const SurfaceMesh mesh = testing::grid_mesh(9, 5, 4.0, 2.0, [](double x, double) {
    return 5.0 + (x < 2.0 ? 0.3 * std::abs(x - 1.0) : 0.2 + 0.1 * std::abs(x - 3.0));
  });
  const FacetField designed(mesh);
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RoundedField field(designed, designed.grid(), cutter, Executor::serial());
  const GridWindow grid = testing::window_at({0.0, 0.0}, 0.0025, 1601, 801);
  const CreaseMap map = crease_map(field, grid, {1.0, 10, 0.9}, 300);
  EXPECT_EQ(map.columns, 4);
  EXPECT_EQ(map.rows, 2);
  const double half = std::atan(0.3);
  const double shallow = std::atan(0.1);
  ASSERT_GE(map.worst.size(), 3U);
  EXPECT_NEAR(map.worst[0].place.x(), 1.0, 1e-9);
  EXPECT_NEAR(map.worst[0].depth, kRadius * (1.0 / std::cos(half) - 1.0), 1e-12);
  EXPECT_NEAR(map.worst[0].width, 2.0 * kRadius * std::sin(half), 1e-12);
  EXPECT_NEAR(map.worst[2].depth, kRadius * (1.0 / std::cos(shallow) - 1.0), 1e-12);
  EXPECT_TRUE(std::is_sorted(map.worst.begin(), map.worst.end(),
                             [](const auto& a, const auto& b) { return a.depth > b.depth; }));
  const double width = 2.0 * kRadius * (std::sin(half) + std::sin(shallow));
  EXPECT_NEAR(map.fillets, width / 4.0, 2.0 * 0.0025 / 4.0);
  EXPECT_NEAR(map.depth[1], kRadius * (1.0 / std::cos(half) - 1.0), 1e-6);

  const CreaseMap in_one = crease_map(field, grid, {1.0, 10, 0.9}, 2000);
  EXPECT_EQ(in_one.depth, map.depth);
  EXPECT_EQ(in_one.share, map.share);
  EXPECT_EQ(in_one.fillets, map.fillets);
}

TEST(CreaseMap, OfACastLensIsThatOfTheLens) {
  // The mould's groove along y at X = 1 is the lens's ridge at x = 3, all of it 1/1.02 as large.
  const double scale = 1.02;
  const SurfaceMesh mesh =
      testing::grid_mesh(9, 5, 4.0 * scale, 2.0 * scale,
                         [&](double x, double) { return 5.0 + 0.3 * std::abs(x - 1.0 * scale); });
  const FacetField designed(mesh);
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RoundedField mould(designed, designed.grid(), cutter, Executor::serial());
  const CastField cast(mould, {.scale = scale, .width = 4.0, .top = 3.0, .thickness = 5.0});
  const HeldField held(cast);
  const CreaseMap map =
      crease_map(held, testing::window_at({0.0, 0.0}, 0.005, 801, 401), {1.0, 1, 0.9}, 300);
  ASSERT_EQ(map.worst.size(), 1U);
  const double half = std::atan(0.3);
  EXPECT_NEAR(map.worst[0].place.x(), 3.0, 1e-9);
  EXPECT_NEAR(map.worst[0].depth, kRadius * (1.0 / std::cos(half) - 1.0) / scale, 1e-9);
  EXPECT_NEAR(map.worst[0].width, 2.0 * kRadius * std::sin(half) / scale, 1e-9);
}

TEST(CreaseMap, ASurfaceWithoutValleysHasNone) {
  const SurfaceMesh mesh = testing::grid_mesh(
      9, 5, 4.0, 2.0, [](double x, double y) { return 5.0 - 0.1 * std::abs(x - 2.0) + 0.2 * y; });
  const FacetField designed(mesh);
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RoundedField field(designed, designed.grid(), cutter, Executor::serial());
  const CreaseMap map = crease_map(field, testing::window_at({0.0, 0.0}, 0.02, 201, 101), {}, 300);
  EXPECT_TRUE(map.worst.empty());
  EXPECT_EQ(map.fillets, 0.0);
}

}  // namespace
}  // namespace lensforge::milled_tiles_test
