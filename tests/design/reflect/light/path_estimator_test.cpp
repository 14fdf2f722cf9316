// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>

#include "design/reflect/input.h"
#include "design/reflect/light/reflection_energy.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

constexpr int kRuns = 100;

/// Mean and standard error of the estimates, of which every run gives one number: the gradient's
/// product with a fixed direction.
struct Estimate {
  double mean = 0.0;
  double error = 0.0;
};

Estimate estimate(const PathEstimator& estimator, const Eigen::Matrix3Xd& normals,
                  const Eigen::Matrix3Xd& direction) {
  double sum = 0.0;
  double squares = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const double x =
        estimator.gradient(normals, static_cast<std::uint64_t>(run)).cwiseProduct(direction).sum();
    sum += x;
    squares += x * x;
  }
  const double mean = sum / kRuns;
  return {mean, std::sqrt((squares / kRuns - mean * mean) / kRuns)};
}

void expect_unbiased(const SurfaceMesh& mesh) {
  const LightField field = make_light_field(ReflectOptions{});
  const LightPaths paths(mesh, field.goal, band_directions(field.elevation, {16, 96, 0.0}), 512,
                         Executor::cpu(2));
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  const ReflectionEnergy energy(paths, Loss::kSquare, Executor::cpu(2), 0.0);
  Eigen::Matrix3Xd exact;
  EXPECT_GT(energy.value_and_gradient(normals, exact), 0.0);
  const PathEstimator estimator(mesh, field, Loss::kSquare, Executor::cpu(2));
  const Estimate sampled = estimate(estimator, normals, exact);
  EXPECT_NEAR(sampled.mean, exact.squaredNorm(), 4.0 * sampled.error + 0.01 * exact.squaredNorm());
}

TEST(PathEstimator, IsUnbiasedForOneReflection) { expect_unbiased(shapes::icosphere(2)); }

TEST(PathEstimator, IsUnbiasedForTwoReflections) { expect_unbiased(shapes::trihedral(3)); }

TEST(PathEstimator, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = shapes::torus(20, 12);
  const LightField field = make_light_field(ReflectOptions{});
  const Eigen::Matrix3Xd normals = measure_faces(mesh).normal;
  EXPECT_EQ(PathEstimator(mesh, field, Loss::kSquare, Executor::serial()).gradient(normals, 3),
            PathEstimator(mesh, field, Loss::kSquare, Executor::cpu(2)).gradient(normals, 3));
}

}  // namespace
}  // namespace lensforge::reflect
