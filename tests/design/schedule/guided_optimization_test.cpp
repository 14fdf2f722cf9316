// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/guided_optimization.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stop_token>
#include <string>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "design/schedule/face_transport.h"
#include "design/test_setups.h"

namespace lensforge::guided_optimization_test {
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
                 const GuidedOptimization::Observer& observe) {
  GuidedOptimization stage(mesh, kSetup, testing::spot_picture(28, 20), options_for(mesh),
                           executor);
  LbfgsOptions options;
  options.max_iterations = iterations;
  return stage.run(options, observe, mesh);
}

bool go_on(int, const DesignObjective::Evaluation&) { return true; }

/// A flat lens after transport.
SurfaceMesh transported() {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const FaceLight light = face_light(mesh, kSetup, SurfaceModel::kFacet, Executor::serial());
  const TransportResult result = transport_faces(
      light, testing::spot_picture(28, 20), TransportOptions{}, Executor::serial(), RunControl());
  EXPECT_TRUE(result.converged());
  aim_faces({result.centroids, light.flux}, kSetup, Executor::serial(), mesh);
  return mesh;
}

TEST(GuidedOptimization, LowersTheObjectiveFromStepToStep) {
  SurfaceMesh mesh = transported();
  double last = std::numeric_limits<double>::infinity();
  const LbfgsSummary summary =
      run(mesh, 15, Executor::serial(), [&](int, const DesignObjective::Evaluation& e) {
        EXPECT_TRUE(e.feasible);
        EXPECT_LE(e.energy.total, last);
        last = e.energy.total;
        return true;
      });
  EXPECT_EQ(summary.iterations, 15);
  RecordProperty("initial", std::to_string(summary.initial_value));
  RecordProperty("final", std::to_string(summary.value));
  EXPECT_LT(summary.value, 0.5 * summary.initial_value);
  EXPECT_EQ(summary.value, last);
}

TEST(GuidedOptimization, MovesXAndYAsWellAsHeights) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  SurfaceMesh mesh = flat;
  run(mesh, 20, Executor::serial(), go_on);
  const Eigen::Matrix3Xd moved = mesh.vertices - flat.vertices;
  EXPECT_GT(moved.row(2).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_GT(moved.topRows<2>().cwiseAbs().maxCoeff(), 1e-3);
}

TEST(GuidedOptimization, KeepsTheOutline) {
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

TEST(GuidedOptimization, KnownScalesAreKeptAndOthersMeasured) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  GuidedOptimization stage(mesh, kSetup, testing::spot_picture(28, 20), options_for(mesh),
                           Executor::serial());
  LbfgsOptions options;
  options.max_iterations = 4;
  StepScales scales;
  stage.run(options, go_on, scales, mesh);
  ASSERT_TRUE(scales.known());
  const StepScales first = scales;
  const SurfaceMesh middle = mesh;
  stage.run(options, go_on, scales, mesh);
  EXPECT_EQ(scales.reach, first.reach);
  EXPECT_EQ(scales.xy, first.xy);
  EXPECT_EQ(scales.z, first.z);
  SurfaceMesh measured = middle;
  stage.run(options, go_on, measured);
  EXPECT_NE(measured.vertices, mesh.vertices);
  SurfaceMesh again = middle;
  GuidedOptimization fresh(middle, kSetup, testing::spot_picture(28, 20), options_for(middle),
                           Executor::serial());
  fresh.run(options, go_on, scales, again);
  EXPECT_EQ(again.vertices, mesh.vertices);
}

TEST(GuidedOptimization, OutcomeDependsOnTheMeshAlone) {
  SurfaceMesh first = make_grid_mesh(kSize, kShape, 5.0);
  GuidedOptimization stage(first, kSetup, testing::spot_picture(28, 20), options_for(first),
                           Executor::serial());
  LbfgsOptions options;
  options.max_iterations = 4;
  stage.run(options, go_on, first);
  SurfaceMesh fresh = first;
  stage.run(options, go_on, first);
  run(fresh, 4, Executor::cpu(2), go_on);
  EXPECT_EQ(first.vertices, fresh.vertices);
}

TEST(GuidedOptimization, StopsWhenTheObserverSaysSo) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  const LbfgsSummary summary =
      run(mesh, 15, Executor::serial(),
          [](int iteration, const DesignObjective::Evaluation&) { return iteration < 3; });
  EXPECT_EQ(summary.status, LbfgsSummary::Status::kStopped);
  EXPECT_EQ(summary.iterations, 3);
}

TEST(GuidedOptimization, ValueIsWhereARunStarts) {
  SurfaceMesh mesh = testing::height_field(kSize, kShape, testing::bumps);
  GuidedOptimization stage(make_grid_mesh(kSize, kShape, 5.0), kSetup,
                           testing::spot_picture(28, 20), options_for(mesh), Executor::serial());
  const double value = stage.value(mesh);
  LbfgsOptions options;
  options.max_iterations = 2;
  EXPECT_EQ(stage.run(options, go_on, mesh).initial_value, value);
}

/// Landing points of the light of a converging lens's faces.
Correspondence converging() {
  const SurfaceMesh lens = testing::height_field(kSize, kShape, [](double x, double y) {
    return 5.0 - 4e-4 * ((x - 13.0) * (x - 13.0) + (y - 10.0) * (y - 10.0));
  });
  const FaceLight light = face_light(lens, kSetup, SurfaceModel::kFacet, Executor::serial());
  return {light.landing, light.flux};
}

TEST(GuidedOptimization, FollowsACorrespondence) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  GuidedOptimization stage(mesh, kSetup, converging(), options_for(mesh), Executor::serial());
  LbfgsOptions options;
  options.max_iterations = 30;
  double first = -1.0;
  double align = 0.0;
  double last = std::numeric_limits<double>::infinity();
  stage.run(
      options,
      [&](int, const DesignObjective::Evaluation& e) {
        EXPECT_LE(e.energy.total, last);
        EXPECT_EQ(e.mae, 0.0);
        last = e.energy.total;
        align = e.energy.align;
        if (first < 0.0) first = align;
        return true;
      },
      mesh);
  const Correspondence wanted = converging();
  const FaceLight flat = face_light(make_grid_mesh(kSize, kShape, 5.0), kSetup,
                                    SurfaceModel::kFacet, Executor::serial());
  const double before = (flat.landing - wanted.centroids).squaredNorm();
  RecordProperty("align_flat", std::to_string(before));
  RecordProperty("align_first", std::to_string(first));
  RecordProperty("align_last", std::to_string(align));
  EXPECT_LT(align, 1e-2 * before);
}

TEST(GuidedOptimization, KeepsTheBestSurfaceWhenItIsStopped) {
  const SurfaceMesh flat = make_grid_mesh(kSize, kShape, 5.0);
  SurfaceMesh mesh = flat;
  std::stop_source stop;
  EXPECT_THROW(run(mesh, 15, Executor::serial().with_stop(stop.get_token()),
                   [&](int iteration, const DesignObjective::Evaluation&) {
                     if (iteration == 3) stop.request_stop();
                     return true;
                   }),
               Interrupted);
  SurfaceMesh after_three = flat;
  run(after_three, 3, Executor::serial(), go_on);
  EXPECT_EQ(mesh.vertices, after_three.vertices);
}

TEST(GuidedOptimization, KnowsWhatIsFeasible) {
  SurfaceMesh mesh = make_grid_mesh(kSize, kShape, 5.0);
  GuidedOptimization stage(mesh, kSetup, testing::spot_picture(28, 20), options_for(mesh),
                           Executor::serial());
  EXPECT_TRUE(std::isfinite(stage.value(mesh)));
  mesh.vertices(2, 15 * kShape.columns + 17) += 5.0;
  EXPECT_EQ(stage.value(mesh), kInfinity);
  const LbfgsSummary summary = stage.run(LbfgsOptions{}, go_on, mesh);
  EXPECT_EQ(summary.status, LbfgsSummary::Status::kInfeasibleStart);
}

}  // namespace
}  // namespace lensforge::guided_optimization_test
