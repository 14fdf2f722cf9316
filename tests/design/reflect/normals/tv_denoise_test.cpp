// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <random>

#include "design/reflect/mesh/faces.h"
#include "design/reflect/shape/normals.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

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
