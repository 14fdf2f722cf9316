// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/rendering_guided.h"

#include <gtest/gtest.h>

#include <limits>

#include "design/test_setups.h"
#include "design/transport/transport_start.h"

namespace lensforge {
namespace {

const Eigen::Vector2d kSize(28.0, 20.0);
const OpticalSetup kSetup = testing::setup_of(kSize, {28, 20}, 100.0);
constexpr GridShape kShape{36, 30};

ObjectiveOptions options_for(const SurfaceMesh& mesh) {
  ObjectiveOptions options;
  options.nu = 0.5;
  options.area = default_area_barrier(kSetup, mesh.triangle_count());
  return options;
}

LbfgsSummary run(SurfaceMesh& mesh, int iterations, const Executor& executor,
                 const RenderingGuided::Observer& observe) {
  RenderingGuided stage(mesh, kSetup, testing::spot_picture(28, 20), options_for(mesh), executor);
  LbfgsOptions options;
  options.max_iterations = iterations;
  return stage.run(options, observe, mesh);
}

bool go_on(int, const DesignObjective::Evaluation&) { return true; }

TEST(RenderingGuided, LowersTheObjectiveFromStepToStep) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  ASSERT_TRUE(start_from_transport(testing::spot_picture(28, 20), kSetup, RunControl(), mesh));
  double last = std::numeric_limits<double>::infinity();
  const LbfgsSummary summary =
      run(mesh, 15, Executor::serial(), [&](int, const DesignObjective::Evaluation& e) {
        EXPECT_TRUE(e.feasible);
        EXPECT_LE(e.energy.total, last);
        last = e.energy.total;
        return true;
      });
  EXPECT_EQ(summary.iterations, 15);
  EXPECT_LT(summary.value, 0.5 * summary.initial_value);
  EXPECT_EQ(summary.value, last);
}

TEST(RenderingGuided, MovesXAndYAsWellAsHeights) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  SurfaceMesh mesh = flat;
  run(mesh, 20, Executor::serial(), go_on);
  const Eigen::Matrix3Xd moved = mesh.vertices - flat.vertices;
  EXPECT_GT(moved.row(2).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_GT(moved.topRows<2>().cwiseAbs().maxCoeff(), 1e-3);
}

TEST(RenderingGuided, KeepsTheOutline) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  SurfaceMesh mesh = flat;
  run(mesh, 10, Executor::serial(), go_on);
  for (int v = 0; v < kShape.columns * kShape.rows; ++v) {
    const int column = v % kShape.columns;
    const int row = v / kShape.columns;
    if (column == 0 || column == kShape.columns - 1) {
      EXPECT_EQ(mesh.vertices(0, v), flat.vertices(0, v));
    }
    if (row == 0 || row == kShape.rows - 1) {
      EXPECT_EQ(mesh.vertices(1, v), flat.vertices(1, v));
    }
  }
}

TEST(RenderingGuided, OutcomeDependsOnTheMeshAlone) {
  SurfaceMesh first = make_grid_mesh(kSize, kShape, 5.0);
  RenderingGuided stage(first, kSetup, testing::spot_picture(28, 20), options_for(first),
                        Executor::serial());
  LbfgsOptions options;
  options.max_iterations = 4;
  stage.run(options, go_on, first);
  SurfaceMesh fresh = first;
  stage.run(options, go_on, first);
  run(fresh, 4, Executor::cpu(2), go_on);
  EXPECT_EQ(first.vertices, fresh.vertices);
}

TEST(RenderingGuided, StopsWhenTheObserverSaysSo) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const LbfgsSummary summary =
      run(mesh, 15, Executor::serial(),
          [](int iteration, const DesignObjective::Evaluation&) { return iteration < 3; });
  EXPECT_EQ(summary.status, LbfgsSummary::Status::kStopped);
  EXPECT_EQ(summary.iterations, 3);
}

TEST(RenderingGuided, KnowsWhatIsFeasible) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  RenderingGuided stage(mesh, kSetup, testing::spot_picture(28, 20), options_for(mesh),
                        Executor::serial());
  EXPECT_TRUE(stage.feasible(mesh));
  mesh.vertices(2, 15 * kShape.columns + 17) += 5.0;
  EXPECT_FALSE(stage.feasible(mesh));
  const LbfgsSummary summary = stage.run(LbfgsOptions{}, go_on, mesh);
  EXPECT_EQ(summary.status, LbfgsSummary::Status::kInfeasibleStart);
}

}  // namespace
}  // namespace lensforge
