// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_shape.h"

#include <gmock/gmock.h>

#include <limits>
#include <stop_token>

#include "core/error.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

ReflectOptions quick() {
  ReflectOptions options;
  options.rim_updates = 2;
  options.face_updates = 3;
  options.split = false;
  return options;
}

ReflectResult shaped(const SurfaceMesh& mesh, const ReflectOptions& options,
                     const Executor& executor = Executor::cpu(2),
                     const RunControl& control = RunControl()) {
  return reflect_shape(prepared_input(mesh, "mesh", options), options, executor, control);
}

TEST(ReflectShape, StealthLowersTheEnergyAndKeepsTheShape) {
  const SurfaceMesh mesh = shapes::ellipsoid({1.3, 0.8, 0.5}, 3);
  const ReflectResult result = shaped(mesh, quick());
  EXPECT_TRUE(result.done());
  EXPECT_LT(result.after.total, 0.5 * result.before.total);
  EXPECT_LT(result.mean_displacement, 0.02);
  EXPECT_EQ(result.updates.size(), 5U);
}

TEST(ReflectShape, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = shapes::torus(24, 14);
  const ReflectResult one = shaped(mesh, quick(), Executor::serial());
  const ReflectResult two = shaped(mesh, quick());
  EXPECT_EQ(one.mesh.vertices, two.mesh.vertices);
}

TEST(ReflectShape, UnitsOfTheMeshDoNotMatter) {
  const SurfaceMesh mesh = shapes::icosphere(2);
  SurfaceMesh large = mesh;
  large.vertices = 1024.0 * mesh.vertices;
  const ReflectResult a = shaped(mesh, quick());
  const ReflectResult b = shaped(large, quick());
  EXPECT_LT((1024.0 * a.mesh.vertices - b.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(ReflectShape, StopsWhenAsked) {
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress& progress) {
    if (progress.done >= 2.0) stop.request_stop();
  });
  const ReflectResult result = shaped(shapes::icosphere(2), quick(), Executor::cpu(2), control);
  EXPECT_FALSE(result.done());
  EXPECT_EQ(result.updates.size(), 2U);
  EXPECT_NE(result.mesh.vertices, result.reference.vertices);
}

TEST(ReflectShape, ThePapersMethodFollowsItsSeedAlone) {
  ReflectOptions options = quick();
  options.method = Method::kPaper;
  options.denoise = 250.0;
  const SurfaceMesh mesh = shapes::icosphere(3);
  const ReflectResult one = shaped(mesh, options, Executor::serial());
  EXPECT_EQ(one.mesh.vertices, shaped(mesh, options).mesh.vertices);
  EXPECT_LT(one.after.total, one.before.total);
  options.seed = 2;
  EXPECT_NE(one.mesh.vertices, shaped(mesh, options).mesh.vertices);
}

TEST(ReflectShape, FixedPartsAndConstraintsHoldToTheEnd) {
  const SurfaceMesh mesh = shapes::ellipsoid({1.0, 0.8, 0.7}, 3);
  ReflectOptions options = quick();
  options.split = true;
  options.fix_plane = "0,0,1,-0.6";
  options.keep_volume = true;
  options.keep_box = true;
  options.max_displacement = 0.1;
  const ReflectResult result = shaped(mesh, options);
  EXPECT_THAT(result.unmet, ::testing::IsEmpty());
  EXPECT_GT(result.mesh.triangle_count(), mesh.triangle_count());
  const Eigen::Matrix3Xd moved = result.mesh.vertices - result.reference.vertices;
  EXPECT_LE(moved.colwise().norm().maxCoeff(), 0.1 + 1e-9);
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.vertices(2, v) <= -0.6) {
      EXPECT_LT(moved.col(v).norm(), 1e-12);
    }
  }
  EXPECT_LT(result.after.total, result.before.total);
}

TEST(ReflectShape, FacadesSendSunlightToPlacesAsThePaperDoes) {
  ReflectOptions options;
  options.split = false;
  options.place = "0,-3,0";
  for (const SurfaceMesh& wall :
       {shapes::concave_facade(0.3, 20), shapes::sine_facade(0.1, 2, 20)}) {
    options.goal = GoalKind::kPoint;
    options.place = "0,-3,0";
    const ReflectResult point = shaped(wall, options);
    EXPECT_GT(point.after.total, 3.5 * point.before.total);
    options.goal = GoalKind::kDeflect;
    const ReflectResult deflect = shaped(wall, options);
    EXPECT_LT(deflect.after.total, 0.09 * deflect.before.total);
    options.goal = GoalKind::kLine;
    options.place = "-2,-3,0,2,-3,0";
    const ReflectResult line = shaped(wall, options);
    EXPECT_GT(line.after.total, 2.8 * line.before.total);
  }
}

TEST(ReflectShape, ATenthOfTheEnergyHasToBeGained) {
  EXPECT_TRUE(gained_enough(GoalKind::kStealth, 0.1, 0.05));
  EXPECT_FALSE(gained_enough(GoalKind::kDeflect, 0.1, 0.095));
  EXPECT_FALSE(gained_enough(GoalKind::kStealth, 0.1, 0.2));
  EXPECT_TRUE(gained_enough(GoalKind::kPoint, 0.2, 0.3));
  EXPECT_FALSE(gained_enough(GoalKind::kLine, 0.2, 0.21));
  EXPECT_FALSE(gained_enough(GoalKind::kPoint, 0.0, 0.0));
  // There was nothing to gain.
  EXPECT_TRUE(gained_enough(GoalKind::kStealth, 8e-5, 8e-5));
  EXPECT_FALSE(gained_enough(GoalKind::kStealth, 8e-5, 0.02));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const GoalKind goal : {GoalKind::kStealth, GoalKind::kPoint}) {
    EXPECT_FALSE(gained_enough(goal, 0.1, nan));
  }
}

TEST(ReflectShape, ARunThatGainedTooLittleSaysSo) {
  ReflectOptions options = quick();
  options.max_displacement = 1e-6;
  const ReflectResult result = shaped(shapes::icosphere(2), options);
  ASSERT_EQ(result.unmet.size(), 1U);
  EXPECT_THAT(result.unmet.front(), ::testing::HasSubstr("less than a tenth of it was gained"));
}

TEST(ReflectShape, ContradictingPlacesAreRefused) {
  ReflectOptions options;
  options.place = "0,0,0";
  EXPECT_THROW(validate(options), InputError);
  options.goal = GoalKind::kLine;
  EXPECT_THROW(validate(options), InputError);
  options.place = "0,0,0,0,0,0";
  EXPECT_THROW(validate(options), InputError);
  options.place = "0,0,0,nan,0,0";
  EXPECT_THROW(validate(options), InputError);
  options.place = "0,0,0,1,0,0";
  EXPECT_NO_THROW(validate(options));
  options.light = "0,0,1;0,0,0";
  EXPECT_THROW(validate(options), InputError);
}

}  // namespace
}  // namespace lensforge::reflect
