// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_shape.h"

#include <gmock/gmock.h>

#include <stop_token>

#include "core/error.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

ReflectOptions quick() {
  ReflectOptions options;
  options.rim_updates = 2;
  options.face_updates = 3;
  return options;
}

TEST(ReflectShape, StealthLowersTheEnergyAndKeepsTheShape) {
  const SurfaceMesh mesh = shapes::ellipsoid({1.3, 0.8, 0.5}, 3);
  const ReflectResult result = reflect_shape(mesh, quick(), Executor::cpu(2), RunControl());
  EXPECT_TRUE(result.done());
  EXPECT_LT(result.after.total, 0.5 * result.before.total);
  EXPECT_LT(result.mean_displacement, 0.02);
  EXPECT_EQ(result.updates.size(), 5U);
}

TEST(ReflectShape, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = shapes::torus(24, 14);
  const ReflectResult one = reflect_shape(mesh, quick(), Executor::serial(), RunControl());
  const ReflectResult two = reflect_shape(mesh, quick(), Executor::cpu(2), RunControl());
  EXPECT_EQ(one.mesh.vertices, two.mesh.vertices);
}

TEST(ReflectShape, UnitsOfTheMeshDoNotMatter) {
  const SurfaceMesh mesh = shapes::icosphere(2);
  SurfaceMesh large = mesh;
  large.vertices = 1024.0 * mesh.vertices;
  const ReflectResult a = reflect_shape(mesh, quick(), Executor::cpu(2), RunControl());
  const ReflectResult b = reflect_shape(large, quick(), Executor::cpu(2), RunControl());
  EXPECT_LT((1024.0 * a.mesh.vertices - b.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(ReflectShape, StopsWhenAsked) {
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress& progress) {
    if (progress.done >= 2.0) stop.request_stop();
  });
  const ReflectResult result =
      reflect_shape(shapes::icosphere(2), quick(), Executor::cpu(2), control);
  EXPECT_FALSE(result.done());
  EXPECT_EQ(result.updates.size(), 2U);
  EXPECT_NE(result.mesh.vertices, result.reference.vertices);
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
