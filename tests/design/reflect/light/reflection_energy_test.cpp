// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/reflection_energy.h"

#include <gmock/gmock.h>

#include <random>

#include "design/finite_difference.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

/// Largest error of the gradient along random directions, relative to the largest slope.
double slope_error(const ReflectionEnergy& energy, const Eigen::Matrix3Xd& normals) {
  Eigen::Matrix3Xd gradient;
  EXPECT_NEAR(energy.value_and_gradient(normals, gradient), energy.value(normals),
              1e-12 * std::abs(energy.value(normals)));
  const auto value = [&](const Eigen::VectorXd& x) {
    return energy.value(Eigen::Map<const Eigen::Matrix3Xd>(x.data(), 3, normals.cols()));
  };
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  double error = 0.0;
  for (int trial = 0; trial < 5; ++trial) {
    const Eigen::VectorXd direction =
        Eigen::VectorXd::NullaryExpr(normals.size(), [&] { return normal(random); }).normalized();
    const double expected = testing::directional_slope(value, normals.reshaped(), direction, 1e-3);
    const double computed = gradient.reshaped().dot(direction);
    error = std::max(error, std::abs(computed - expected) / std::abs(expected));
  }
  return error;
}

double slope_error(const SurfaceMesh& mesh, const Goal& goal, Loss loss) {
  const DirectionSet directions =
      goal.has_place() ? sun_directions(6) : band_directions(0.35, {3, 12, 0.1});
  const LightPaths paths(mesh, goal, directions, 32, Executor::cpu(2));
  return slope_error(ReflectionEnergy(paths, loss, Executor::cpu(2)), paths.faces().normal);
}

TEST(ReflectionEnergy, GradientMatchesFiniteDifferencesWithoutOcclusion) {
  EXPECT_LT(slope_error(shapes::icosphere(2), {}, Loss::kSquare), 1e-5);
}

TEST(ReflectionEnergy, GradientMatchesFiniteDifferencesWithOcclusionAndTwoReflections) {
  EXPECT_LT(slope_error(shapes::torus(16, 10), {}, Loss::kSquare), 1e-5);
  EXPECT_LT(slope_error(shapes::trihedral(4), {}, Loss::kSquare), 1e-5);
}

TEST(ReflectionEnergy, GradientMatchesFiniteDifferencesForPlaces) {
  const SurfaceMesh wall = shapes::concave_facade(0.3, 8);
  const Goal line{GoalKind::kLine, {-1.0, -2.0, 0.0}, {1.0, -2.0, 0.0}};
  for (const Loss loss : {Loss::kSquare, Loss::kNegativeSquare, Loss::kInverse}) {
    EXPECT_LT(slope_error(wall, {GoalKind::kPoint, {0.0, -2.0, 0.0}, {}}, loss), 1e-5);
    EXPECT_LT(slope_error(wall, line, loss), 1e-5);
  }
}

TEST(ReflectionEnergy, HitsBelowTheFloorHardlyChangeTheGradient) {
  for (const SurfaceMesh& mesh : {shapes::torus(32, 20), shapes::trihedral(8)}) {
    const DirectionSet directions = band_directions(0.35, {6, 24, 0.1});
    const LightPaths paths(mesh, Goal{}, directions, kGatherDirections, Executor::cpu(2));
    const Eigen::Matrix3Xd& normals = paths.faces().normal;
    const ReflectionEnergy all(paths, Loss::kSquare, Executor::cpu(2), 0.0);
    const ReflectionEnergy most(paths, Loss::kSquare, Executor::cpu(2));
    Eigen::Matrix3Xd exact;
    Eigen::Matrix3Xd gradient;
    EXPECT_NEAR(all.value_and_gradient(normals, exact), most.value_and_gradient(normals, gradient),
                1e-6);
    EXPECT_LT((gradient - exact).norm(), 0.01 * exact.norm());
  }
}

TEST(ReflectionEnergy, FacesAddUpToTheValueAndToThatOfTheGradient) {
  const SurfaceMesh mesh = shapes::torus(24, 12);
  const LightPaths paths(mesh, Goal{}, band_directions(0.35, {3, 12, 0.0}), 64, Executor::cpu(2));
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::cpu(2));
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  Eigen::Matrix3Xd gradient;
  const double value = energy.value_and_gradient(normals, gradient);
  EXPECT_NEAR(energy.by_face(normals).sum(), value, 1e-12);
  EXPECT_GT(value, 1.001 * energy.direct_value(normals));
}

}  // namespace
}  // namespace lensforge::reflect
