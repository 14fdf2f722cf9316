// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "design/schedule/levels.h"

namespace lensforge {
namespace {

DesignOptions with_levels(int levels, double ratio = 1.25) {
  DesignOptions options;
  options.model = SurfaceModel::kSmooth;
  options.levels = levels;
  options.mesh_ratio = ratio;
  return options;
}

GridShape finest_grid(int columns, int rows, double ratio) {
  return plan_levels({columns, rows}, with_levels(1, ratio)).back().grid;
}

TEST(LevelPlan, FinestGridsAreThoseOfThePaper) {
  EXPECT_EQ(finest_grid(512, 512, 1.25), (GridShape{641, 737}));
  EXPECT_EQ(finest_grid(256, 256, 1.25), (GridShape{321, 369}));
  EXPECT_EQ(finest_grid(256, 256, 2.5), (GridShape{641, 737}));
}

TEST(LevelPlan, OneLevelIsTheFullSize) {
  const std::vector<Level> levels = plan_levels({256, 192}, with_levels(1));
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_EQ(levels[0].pixels, Eigen::Vector2i(256, 192));
}

TEST(LevelPlan, EachLevelHasTwiceTheResolutionOfTheOneBefore) {
  const std::vector<Level> levels = plan_levels({512, 384}, with_levels(4));
  ASSERT_EQ(levels.size(), 4U);
  EXPECT_EQ(levels.back().pixels, Eigen::Vector2i(512, 384));
  for (std::size_t l = 1; l < levels.size(); ++l) {
    EXPECT_EQ(levels[l].pixels, 2 * levels[l - 1].pixels);
    EXPECT_EQ(levels[l].grid.columns - 1, 2 * (levels[l - 1].grid.columns - 1));
    EXPECT_EQ(levels[l].grid.rows - 1, 2 * (levels[l - 1].grid.rows - 1));
  }
}

TEST(LevelPlan, TheCoarsestPictureIsNotBelow32Pixels) {
  const std::vector<Level> levels = plan_levels({512, 512}, with_levels(20));
  EXPECT_EQ(levels.size(), 5U);
  EXPECT_EQ(levels.front().pixels, Eigen::Vector2i(32, 32));
  EXPECT_EQ(plan_levels({24, 24}, with_levels(5)).size(), 1U);
  EXPECT_EQ(plan_levels({64, 8}, with_levels(5)).size(), 2U);
}

TEST(LevelPlan, OddSizesKeepTheirFullSize) {
  for (const Eigen::Vector2i& size : {Eigen::Vector2i(201, 133), Eigen::Vector2i(77, 501)}) {
    const std::vector<Level> levels = plan_levels(size, with_levels(4));
    EXPECT_EQ(levels.back().pixels, size);
  }
}

TEST(LevelPlan, CellsFollowTheShapeOfThePicture) {
  const GridShape wide = finest_grid(400, 100, 1.0);
  EXPECT_EQ(wide.columns, 401);
  EXPECT_EQ(wide.rows, 116);
  const GridShape high = finest_grid(100, 400, 1.0);
  EXPECT_EQ(high.columns, 101);
  EXPECT_EQ(high.rows, 461);
}

TEST(LevelPlan, NuFallsByAFixedRatioToItsLastValue) {
  const std::vector<Level> levels = plan_levels({256, 256}, with_levels(3));
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_GT(levels[0].nu, levels[1].nu);
  EXPECT_GT(levels[1].nu, levels[2].nu);
  EXPECT_NEAR(levels[0].nu / levels[1].nu, levels[1].nu / levels[2].nu, 1e-12);
  EXPECT_DOUBLE_EQ(plan_levels({256, 256}, with_levels(1))[0].nu, levels[2].nu);
}

TEST(LevelPlan, NuIsACurvatureThatMovesLightByPixelsPerCell) {
  const double nu = plan_levels({256, 256}, with_levels(1))[0].nu;
  DesignOptions options = with_levels(1);
  options.focal_length *= 2.0;
  EXPECT_NEAR(plan_levels({256, 256}, options)[0].nu, 0.5 * nu, 1e-12);
  options = with_levels(1);
  options.ior = 1.0 + 2.0 * 0.49;
  EXPECT_NEAR(plan_levels({256, 256}, options)[0].nu, 0.5 * nu, 1e-12);
  EXPECT_NEAR(plan_levels({256, 256}, with_levels(1, 2.5))[0].nu, 2.0 * nu, 1e-12);
}

TEST(LevelPlan, WorkingSizeKeepsTheShapeOfTheSource) {
  EXPECT_EQ(working_size(1024, 768, 256), Eigen::Vector2i(256, 192));
  EXPECT_EQ(working_size(768, 1024, 256), Eigen::Vector2i(192, 256));
  EXPECT_EQ(working_size(300, 300, 300), Eigen::Vector2i(300, 300));
  EXPECT_EQ(working_size(1000, 1, 100), Eigen::Vector2i(100, 1));
  EXPECT_EQ(working_size(1, 1, 1), Eigen::Vector2i(1, 1));
}

TEST(LevelPlan, ASplineFollowsFewerRoundsOfTheMesh) {
  DesignOptions options = with_levels(1);
  options.model = SurfaceModel::kSpline;
  const std::vector<Level> levels = plan_levels({128, 64}, options);
  ASSERT_EQ(levels.size(), 2U);
  EXPECT_FALSE(levels[0].spline);
  EXPECT_EQ(levels[0].rounds, 1);
  EXPECT_EQ(levels[0].iterations, 120);  // Twice what 64 pixels take.
  EXPECT_TRUE(levels[1].spline);
  EXPECT_EQ(levels[1].rounds, 2);
  EXPECT_EQ(levels[1].iterations, 36);
  // Two knot cells each way in a cell of 160 across.
  EXPECT_EQ(levels[1].grid, (GridShape{323, 163}));
}

TEST(LevelPlan, TheDefaultIsASplineWhereEachCellOfTheMeshHasAKnotCell) {
  const DesignOptions options;
  for (const int side : {4, 256, 527}) {
    EXPECT_EQ(default_model({side, side}, options), SurfaceModel::kSpline) << side;
  }
  EXPECT_EQ(default_model({528, 528}, options), SurfaceModel::kSmooth);
  EXPECT_EQ(default_model({16384, 16}, options), SurfaceModel::kSpline);
  EXPECT_EQ(default_model({16384, 16384}, options), SurfaceModel::kSmooth);
  EXPECT_EQ(default_model({300, 300}, with_levels(1, 2.5)), SurfaceModel::kSmooth);
  EXPECT_EQ(default_model({256, 256}, with_levels(1, 2.5)), SurfaceModel::kSpline);
}

TEST(LevelPlan, ASmoothMeshTakesThreeRoundsTogether) {
  DesignOptions options = with_levels(1);
  const auto plan = [&](int rounds) {
    options.rounds = rounds;
    const Level level = plan_levels({64, 64}, options).front();
    return Eigen::Vector2i(level.rounds, level.iterations);
  };
  options.model = SurfaceModel::kSmooth;
  EXPECT_EQ(plan(6), Eigen::Vector2i(2, 240));
  EXPECT_EQ(plan(4), Eigen::Vector2i(2, 160));
  EXPECT_EQ(plan(3), Eigen::Vector2i(1, 240));
  EXPECT_EQ(plan(1), Eigen::Vector2i(1, 100));
  options.transport_rounds = 2;
  EXPECT_EQ(plan(6), Eigen::Vector2i(6, 100));
  options.model = SurfaceModel::kFacet;
  options.transport_rounds = 1;
  EXPECT_EQ(plan(6), Eigen::Vector2i(6, 100));
}

TEST(LevelPlan, ASplineFitsASolidsFile) {
  DesignOptions options = with_levels(1);
  options.model = SurfaceModel::kSpline;
  for (const Eigen::Vector2i& size : {Eigen::Vector2i(512, 512), Eigen::Vector2i(2048, 300)}) {
    const GridShape grid = plan_levels(size, options).back().grid;
    EXPECT_NEAR((grid.columns - 3.0) * (grid.rows - 3.0), kMaxKnotCells, 0.01 * kMaxKnotCells);
  }
}

}  // namespace
}  // namespace lensforge
