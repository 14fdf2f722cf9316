// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "design/finite_difference.h"
#include "design/reflect/shape/normals.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

Eigen::Matrix3Xd columns(const Eigen::VectorXd& x) { return x.reshaped(3, x.size() / 3); }

TEST(NormalObjective, GradientMatchesFiniteDifferences) {
  const SurfaceMesh mesh = shapes::torus(8, 6);
  const LightPaths paths(mesh, Goal{}, band_directions(0.35, {3, 12, 0.1}), 32, Executor::serial());
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::serial());
  Eigen::Matrix3Xd reference = paths.faces().normal;
  reference.row(2).array() += 0.2;
  const NormalAnchor anchor{reference.colwise().normalized(), 0.3};
  const Eigen::VectorXd share = paths.faces().area_share();
  const NormalObjective objective(energy, anchor, share);
  Eigen::Matrix3Xd ignored;
  const auto value = [&](const Eigen::VectorXd& x) { return objective(columns(x), ignored); };
  const Eigen::VectorXd x = 1.3 * paths.faces().normal.reshaped();
  Eigen::Matrix3Xd gradient;
  EXPECT_EQ(objective(columns(x), gradient), value(x));
  EXPECT_LT(testing::plateau_error(gradient.reshaped(), value, x, 1e-3), 1e-5);
}

TEST(NormalObjective, NormalsOfASphereLeaveTheBand) {
  const SurfaceMesh mesh = shapes::icosphere(3);
  const LightPaths paths(mesh, Goal{}, band_directions(0.35, {8, 48, 0.0}), 0, Executor::cpu(2));
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::cpu(2));
  const NormalAnchor anchor{paths.faces().normal, 0.1};
  const Eigen::VectorXd share = paths.faces().area_share();
  const NormalObjective objective(energy, anchor, share);
  const Eigen::Matrix3Xd tilted = turned_by_face(objective, paths, Goal{}, paths.faces().normal);
  const Eigen::Matrix3Xd near = descended_by_face(objective, tilted, 16, Executor::cpu(2));
  const Eigen::Matrix3Xd optimum = optimized_normals(objective, near, 30, Executor::cpu(2));
  const double first = energy.value(paths.faces().normal);
  EXPECT_LT(energy.value(near), 0.2 * first);
  EXPECT_LT(energy.value(optimum), 0.15 * first);
  Eigen::Matrix3Xd ignored;
  EXPECT_LE(objective(optimum, ignored), objective(near, ignored));
}

TEST(NormalObjective, DescentByFaceLowersItAndDoesNotDependOnTheThreads) {
  const SurfaceMesh mesh = shapes::torus(24, 14);
  const LightPaths paths(mesh, Goal{}, band_directions(0.35, {4, 24, 0.0}), 64, Executor::cpu(2));
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::cpu(2));
  const NormalAnchor anchor{paths.faces().normal, 0.1};
  const Eigen::VectorXd share = paths.faces().area_share();
  const NormalObjective objective(energy, anchor, share);
  const Eigen::Matrix3Xd& start = paths.faces().normal;
  const Eigen::Matrix3Xd end = descended_by_face(objective, start, 8, Executor::cpu(2));
  Eigen::Matrix3Xd ignored;
  EXPECT_LT(objective(end, ignored), 0.7 * objective(start, ignored));
  EXPECT_EQ(end, descended_by_face(objective, start, 8, Executor::serial()));
}

}  // namespace
}  // namespace lensforge::reflect
