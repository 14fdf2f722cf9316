// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/levels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/lens/smooth_surface.h"
#include "core/lens/surface_check.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"
#include "core/spline/sample_splines.h"
#include "design/graded_mesh.h"
#include "design/random_input.h"
#include "design/schedule/rounds.h"
#include "design/test_setups.h"

namespace lensforge::levels_test {
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
  // Two knot cells each way per cell, 160 cells across; 322 has the factor 23.
  EXPECT_EQ(levels[1].grid, (GridShape{321, 163}));
}

TEST(LevelPlan, PicturesOfAnExtendedLampAreCorrectedInTwiceTheRounds) {
  DesignOptions options = with_levels(1);
  options.model = SurfaceModel::kSpline;
  options.light.model = LightModel::kRays;
  options.light.source_angle = 2.0;
  const std::vector<Level> levels = plan_levels({128, 64}, options);
  ASSERT_EQ(levels.size(), 2U);
  EXPECT_EQ(levels[0].rounds, 2);
  EXPECT_EQ(levels[0].iterations, 120);
  EXPECT_EQ(levels[1].rounds, 4);
  EXPECT_EQ(levels[1].iterations, 36);
  // Those of waves, and of a process, are not corrected.
  options.light.model = LightModel::kWaves;
  EXPECT_EQ(plan_levels({128, 64}, options)[1].rounds, 2);
  options.light.model = LightModel::kRays;
  options.made_by = MadeBy();
  EXPECT_EQ(plan_levels({128, 64}, options)[0].rounds, 1);
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
    const double cells = (grid.columns - 3.0) * (grid.rows - 3.0);
    EXPECT_LE(cells, 1.001 * kMaxKnotCells);
    EXPECT_GT(cells, 0.95 * kMaxKnotCells);
  }
}

const Eigen::Vector2d kSize(24.0, 20.0);
constexpr GridShape kCoarse{17, 16};
constexpr GridShape kFine{33, 31};

double mean_area(const GridShape& shape) {
  return kSize.prod() / (2.0 * (shape.columns - 1) * (shape.rows - 1));
}

/// Border vertices anywhere on the border, the others anywhere within.
SurfaceMesh shuffled_mesh(std::uint64_t seed) {
  testing::Random random(seed);
  SurfaceMesh mesh = make_grid_mesh(kSize, kFine, 5.0);
  for (int v = 0; v < kFine.columns * kFine.rows; ++v) {
    const int column = v % kFine.columns;
    const int row = v / kFine.columns;
    const double x = random.between(0.0, kSize.x());
    const double y = random.between(0.0, kSize.y());
    if (column > 0 && column + 1 < kFine.columns) mesh.vertices(0, v) = x;
    if (row > 0 && row + 1 < kFine.rows) mesh.vertices(1, v) = y;
  }
  return mesh;
}

void expect_border_kept(const SurfaceMesh& mesh) {
  const SurfaceMesh flat = make_grid_mesh(kSize, mesh.grid, 0.0);
  for (int v = 0; v < mesh.grid.columns * mesh.grid.rows; ++v) {
    const int column = v % mesh.grid.columns;
    const int row = v / mesh.grid.columns;
    if (column == 0 || column + 1 == mesh.grid.columns) {
      ASSERT_EQ(mesh.vertices(0, v), flat.vertices(0, v)) << v;
    }
    if (row == 0 || row + 1 == mesh.grid.rows) {
      ASSERT_EQ(mesh.vertices(1, v), flat.vertices(1, v)) << v;
    }
  }
}

TEST(EvenOut, UnfoldsWhatCubicsHaveFoldedOver) {
  int folded = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const SurfaceMesh coarse = testing::graded_mesh(kSize, kCoarse, 0.35, seed);
    SurfaceMesh fine = regrid(coarse, kSize, kFine);
    const bool in_order = testing::projected_areas(coarse).minCoeff() > 0.0;
    if (in_order && testing::projected_areas(fine).minCoeff() <= 0.0) ++folded;
    const double least = 0.02 * mean_area(kFine);
    even_out(least, fine);
    EXPECT_GE(testing::projected_areas(fine).minCoeff(), least);
    expect_border_kept(fine);
  }
  EXPECT_GT(folded, 0) << "no mesh that shows the fault";
}

TEST(EvenOut, EndsOnAnyMeshWithinTheBorder) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    SurfaceMesh mesh = shuffled_mesh(seed);
    const double least = 0.02 * mean_area(kFine);
    even_out(least, mesh);
    EXPECT_GE(testing::projected_areas(mesh).minCoeff(), least);
    expect_border_kept(mesh);
  }
}

TEST(EvenOut, AnEvenMeshStaysWhereItIs) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kFine, 5.0);
  SurfaceMesh mesh = flat;
  even_out(0.02 * mean_area(kFine), mesh);
  // Where the half-cell shift fades, vertices are not midway between their neighbours.
  const double cell = kSize.x() / (kFine.columns - 1);
  EXPECT_LT((mesh.vertices - flat.vertices).cwiseAbs().maxCoeff(), 0.3 * cell);
  EXPECT_GT(testing::projected_areas(mesh).minCoeff(), 0.6 * mean_area(kFine));
}

TEST(EvenOut, APlaneStaysAPlane) {
  SurfaceMesh mesh = testing::graded_mesh(kSize, kFine, 0.6, 3);
  const auto height = [](const Eigen::Vector3d& p) { return 5.0 + 0.03 * p.x() - 0.02 * p.y(); };
  for (auto p : mesh.vertices.colwise()) p.z() = height(p);
  even_out(0.02 * mean_area(kFine), mesh);
  for (const auto p : mesh.vertices.colwise()) EXPECT_NEAR(p.z(), height(p), 1e-12);
}

const Eigen::Vector2d kLensSize(24.0, 20.0);

TEST(SplineStart, HasTheSlopesOfTheMeshAndItsRectangle) {
  const SurfaceMesh mesh = testing::height_field(kLensSize, {49, 47}, &testing::bumps);
  const ControlNet net =
      spline_through(mesh, kLensSize, {99, 83}, 1.0, Executor::serial(), RunControl());
  EXPECT_FALSE(spline_fault(net, testing::setup_of(kLensSize, {24, 20}, 60.0)));
  const SmoothSurface surface(mesh);
  for (double x = 3.0; x < 21.0; x += 1.37) {
    for (double y = 3.0; y < 17.0; y += 1.19) {
      const Eigen::Vector2d start(x / kLensSize.x() * 96.0, y / kLensSize.y() * 80.0);
      const SurfaceShape shape = net.at(net.parameters_of({x, y}, start)).shape();
      EXPECT_LT((shape.slope - surface.model_at({x, y})->slope).norm(), 5e-4);
    }
  }
}

TEST(SplineStart, SettledRestsOnTheThicknessAndKeepsTheRim) {
  const ControlNet net = settled(testing::sample_spline(), 3.0);
  EXPECT_NEAR(spline_nodes(net, kMeshSamples).mesh.vertices.row(2).minCoeff(), 3.0, 2e-9);
  EXPECT_FALSE(spline_fault(net, testing::setup_of({15.0, 10.0}, {24, 16}, 60.0)));
  const Eigen::Matrix3Xd moved = net.points - testing::sample_spline().points;
  EXPECT_LE(moved.topRows<2>().cwiseAbs().maxCoeff(), 0.5001e-7);
  EXPECT_LT(moved.row(2).maxCoeff() - moved.row(2).minCoeff(), 1.001e-9);
}

/// Discs and strokes of any brightness on a ground that is often black.
Image random_scene(testing::Random& random, int columns, int rows) {
  Image image(columns, rows);
  const double ground = std::max(0.0, random.between(-0.3, 0.6));
  for (float& value : image.values()) value = static_cast<float>(ground);
  const int shapes = 1 + random.below(6);
  for (int s = 0; s < shapes; ++s) {
    // One draw a statement: compilers differ in which argument they evaluate first.
    const double y = random.between(0.0, rows);
    const Eigen::Vector2d a(random.between(0.0, columns), y);
    const double length = random.below(2) * 0.5 * columns;
    const Eigen::Vector2d way = length * random.vector2();
    const double radius = random.between(1.5, way.isZero() ? 20.0 : 4.0);
    const auto light = static_cast<float>(random.between(0.1, 1.0));
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        const Eigen::Vector2d from = Eigen::Vector2d(c + 0.5, r + 0.5) - a;
        const double along =
            way.isZero() ? 0.0 : std::clamp(from.dot(way) / way.squaredNorm(), 0.0, 1.0);
        if ((from - along * way).norm() < radius) image.at(c, r) = light;
      }
    }
  }
  return image;
}

DesignOptions two_levels(SurfaceModel model, const Image& picture) {
  DesignOptions options = default_design_options(model, picture);
  options.width = 12.0;
  options.focal_length = 36.0;
  options.levels = 2;
  return with_smoothness_applied(options);
}

/// False if a barrier refuses the mesh.
bool is_allowed(const DesignTask& task, const Level& level, const SurfaceMesh& mesh) {
  const LevelProblem problem = make_problem(task, level, mesh.triangle_count());
  GuidedOptimization stage(mesh, problem.setup, problem.target, problem.objective, task.executor);
  return std::isfinite(stage.value(mesh));
}

double least_area(const SurfaceMesh& mesh) {
  double least = mesh.plan_area(0);
  for (Eigen::Index f = 1; f < mesh.triangles.cols(); ++f) {
    least = std::min(least, mesh.plan_area(f));
  }
  return least;
}

TEST(LevelStart, HasNoFoldedAndNoTinyTriangleForAnyPicture) {
  int folded = 0;
  for (std::uint64_t seed = 1; seed <= 18; ++seed) {
    SCOPED_TRACE(seed);
    testing::Random random(seed);
    const int rows = 40 + random.below(8);
    const int columns = 46 + random.below(8);
    const Image picture = random_scene(random, columns, rows);
    DesignOptions options =
        two_levels(random.below(2) == 0 ? SurfaceModel::kFacet : SurfaceModel::kSmooth, picture);
    options.rounds = 1 + random.below(4);
    options.iterations = 1 + random.below(20);
    const RunControl control;
    DesignTask task = make_task(picture, options, Executor::serial(), control);
    ASSERT_EQ(task.levels.size(), 2U);
    const Level fine = task.levels.back();
    task.levels.pop_back();
    Checkpoint state = first_state(task);
    DesignLog log(task, state);
    ASSERT_TRUE(run_levels(task, log, state));

    const SurfaceMesh plain = regrid(state.mesh, task.setup.lens_size, fine.grid);
    if (least_area(plain) <= 0.0) ++folded;
    const SurfaceMesh start = level_start(task, fine, state.mesh, control);
    EXPECT_EQ(start.grid, fine.grid);
    const double mean = task.setup.lens_size.prod() / static_cast<double>(start.triangle_count());
    EXPECT_GT(least_area(start), 10.0 * kMinArea * mean);
    EXPECT_TRUE(is_allowed(task, fine, start));
  }
  EXPECT_GT(folded, 0) << "no picture that shows the fault";
}

TEST(LevelStart, ASplineOfASurfaceThatReflectsTotallyIsDrawnBackUntilItDoesNot) {
  const Image picture = testing::spot_picture(24, 20);
  DesignOptions options = two_levels(SurfaceModel::kSpline, picture);
  const RunControl control;
  const DesignTask task = make_task(picture, options, Executor::serial(), control);
  const Level& level = task.levels.back();
  ASSERT_TRUE(level.spline);
  const SurfaceMesh steep = testing::height_field(task.setup.lens_size, task.levels.front().grid,
                                                  [](double x, double) { return 2.0 * x; });
  const SurfaceMesh start = level_start(task, level, steep, control);
  EXPECT_EQ(start.grid, level.grid);
  EXPECT_TRUE(is_allowed(task, level, start));
  EXPECT_GT(start.vertices.row(2).maxCoeff() - start.vertices.row(2).minCoeff(), 1.0)
      << "no farther than it needs";
}

}  // namespace

}  // namespace lensforge::levels_test
