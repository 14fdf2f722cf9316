// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/shape/normals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "design/finite_difference.h"
#include "design/reflect/input.h"
#include "design/reflect/mesh/faces.h"
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

TEST(FixedSteps, AFaceThatHasLostItsAreaKeepsANormal) {
  SurfaceMesh mesh = shapes::icosphere(1);
  const Eigen::Matrix3Xd reference = measure_faces(mesh).normal;
  mesh.vertices.col(mesh.triangles(1, 0)) = mesh.vertices.col(mesh.triangles(0, 0));
  const Eigen::VectorXd share = measure_faces(mesh).area_share();
  ASSERT_EQ(share.minCoeff(), 0.0);
  const LightField field = make_light_field(ReflectOptions{});
  const PathEstimator estimator(mesh, field, Loss::kSquare, Executor::cpu(2));
  const Eigen::Matrix3Xd normals =
      stepped_normals(estimator, {reference, 0.1}, share, reference, 8, 1);
  EXPECT_LT((normals.colwise().norm().array() - 1.0).abs().maxCoeff(), 1e-12);
}

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

Eigen::Vector3d turned(double angle) { return {std::sin(angle), 0.0, std::cos(angle)}; }

TEST(UnmetTurns, TargetsThatAreReachedStayAsTheyAre) {
  UnmetTurns unmet(Eigen::Matrix3Xd::Zero(3, 1));
  unmet.record(kUp, kUp);
  EXPECT_EQ(unmet.added_to(kUp), kUp);
}

TEST(UnmetTurns, SumOfWhatIsMissingIsAdded) {
  UnmetTurns unmet(Eigen::Matrix3Xd::Zero(3, 1));
  const Eigen::Vector3d target = turned(0.1);
  for (int i = 0; i < 3; ++i) unmet.record(target, kUp);
  const Eigen::Vector3d expected = (target + 3.0 * kUnmetStep * (target - kUp)).normalized();
  EXPECT_LT((unmet.added_to(target) - expected).norm(), 1e-14);
}

TEST(UnmetTurns, FacesThatNeverTurnAreNotAskedForMoreThanTheLargestSum) {
  UnmetTurns unmet(Eigen::Matrix3Xd::Zero(3, 1));
  const Eigen::Vector3d target = turned(0.4);
  for (int i = 0; i < 1000; ++i) unmet.record(target, kUp);
  const Eigen::Vector3d missing = (target - kUp).normalized();
  const Eigen::Vector3d expected = (target + kLargestUnmetTurn * missing).normalized();
  EXPECT_LT((unmet.added_to(target) - expected).norm(), 1e-12);
}

Eigen::Matrix3Xd noisy(const Eigen::Matrix3Xd& normals, double noise) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, noise);
  const Eigen::Matrix3Xd added = Eigen::Matrix3Xd::NullaryExpr(
      3, normals.cols(), [&](Eigen::Index, Eigen::Index) { return normal(random); });
  return (normals + added).colwise().normalized();
}

double mean_angle(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).colwise().norm().mean();
}

TEST(TvDenoise, TakesNoiseFromACubeAndKeepsItsEdges) {
  const SurfaceMesh mesh = shapes::cube(12);
  const Eigen::Matrix3Xd clean = measure_faces(mesh).normal;
  const Eigen::Matrix3Xd input = noisy(clean, 0.1);
  const Eigen::Matrix3Xd output = TvDenoiser(mesh, 20.0).denoise(input);
  EXPECT_LT(mean_angle(output, clean), 0.25 * mean_angle(input, clean));
}

TEST(TvDenoise, LowersItsObjective) {
  const SurfaceMesh mesh = shapes::icosphere(3);
  const Eigen::Matrix3Xd input = noisy(measure_faces(mesh).normal, 0.1);
  const TvDenoiser denoiser(mesh, 250.0);
  const Eigen::Matrix3Xd output = denoiser.denoise(input);
  EXPECT_LT(denoiser.objective(output, input, output), denoiser.objective(input, input, output));
}

TEST(TvDenoise, LargeFidelityChangesNothing) {
  const SurfaceMesh mesh = shapes::icosphere(3);
  const Eigen::Matrix3Xd input = noisy(measure_faces(mesh).normal, 0.1);
  EXPECT_LT(mean_angle(TvDenoiser(mesh, 1e8).denoise(input), input), 1e-4);
}

}  // namespace

}  // namespace lensforge::reflect
