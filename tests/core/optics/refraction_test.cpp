// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/refraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "design/finite_difference.h"
#include "design/random_input.h"
#include "design/snell.h"

namespace lensforge {
namespace {

using testing::Random;

/// A unit vector `angle` away from n.
Eigen::Vector3d turned_away(Random& random, const Eigen::Vector3d& n, double angle) {
  const Eigen::Vector3d sideways = n.cross(random.vector3()).normalized();
  return std::cos(angle) * n + std::sin(angle) * sideways;
}

struct Ray {
  double eta;
  Eigen::Vector3d normal;
  Eigen::Vector3d direction;  ///< Less than the critical angle away from the normal.
};

Ray random_ray(Random& random) {
  const double eta = random.between(1.01, 2.5);
  const Eigen::Vector3d n = random.near_z(std::numbers::pi);
  return {eta, n, turned_away(random, n, random.between(0.0, 0.99 * std::asin(1 / eta)))};
}

TEST(Refraction, FollowsSnellsLaw) {
  Random random(1);
  for (int i = 0; i < 5000; ++i) {
    const auto [eta, n, a] = random_ray(random);
    const Eigen::Vector3d b = refract(a, n, eta);
    EXPECT_NEAR(n.cross(b).norm(), eta * n.cross(a).norm(), 1e-14);
    EXPECT_LT((b - testing::refract_by_angles(a, n, eta)).norm(), 1e-14);
  }
}

TEST(Refraction, KeepsUnitLengthPlaneAndDirectionOfTravel) {
  Random random(2);
  for (int i = 0; i < 5000; ++i) {
    const auto [eta, n, a] = random_ray(random);
    const Eigen::Vector3d b = refract(a, n, eta);
    EXPECT_NEAR(b.norm(), 1.0, 1e-14);
    EXPECT_NEAR(b.dot(n.cross(a)), 0.0, 1e-14);
    EXPECT_GT(b.dot(n), 0.0);
    EXPECT_GE(n.cross(b).dot(n.cross(a)), 0.0);
  }
}

TEST(Refraction, PerpendicularLightGoesStraightOn) {
  const Eigen::Vector3d n = Eigen::Vector3d(0.2, -0.4, 0.7).normalized();
  EXPECT_LT((refract(n, n, 1.49) - n).norm(), 1e-15);
  EXPECT_EQ(RefractedBeam({0.0, 0.0, 1.0}, 1.49).m, Eigen::Vector2d(0.0, 0.0));
}

TEST(Refraction, LightIsTotallyReflectedBeyondTheCriticalAngle) {
  for (const double eta : {1.1, 1.33, 1.49, 2.4}) {
    const double critical = std::asin(1.0 / eta);
    EXPECT_NEAR(refracted_cosine_squared(std::cos(critical), eta), 0.0, 1e-14);
    EXPECT_GT(refracted_cosine_squared(std::cos(critical - 1e-9), eta), 0.0);
    EXPECT_LT(refracted_cosine_squared(std::cos(critical + 1e-9), eta), 0.0);
    EXPECT_NEAR(refracted_cosine_squared(1.0, eta), 1.0, 1e-15);
  }
}

TEST(Refraction, LightJustBelowTheCriticalAngleLeavesAlongTheSurface) {
  const double eta = 1.49;
  Random random(3);
  const Eigen::Vector3d n(0.0, 0.0, 1.0);
  const Eigen::Vector3d a = turned_away(random, n, std::asin(1.0 / eta) - 1e-10);
  EXPECT_NEAR(refract(a, n, eta).dot(n), 0.0, 1e-4);
}

TEST(Refraction, SlopeIsTheTangentOfTheDeflection) {
  Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const double eta = random.between(1.1, 2.0);
    const Eigen::Vector3d n = random.near_z(0.9 * std::asin(1.0 / eta));
    EXPECT_LT((RefractedBeam(n, eta).m - testing::slope_by_angles(n, eta)).norm(), 1e-12);
  }
}

TEST(Refraction, SlopeOfATiltedSurfacePointsDownhill) {
  // A surface that rises with x has a normal towards −x and sends light to +x: a prism's base is
  // where its light goes.
  const Eigen::Vector3d n = Eigen::Vector3d(-0.1, 0.0, 1.0).normalized();
  EXPECT_GT(RefractedBeam(n, 1.49).m.x(), 0.0);
  EXPECT_NEAR(RefractedBeam(n, 1.49).m.x(), 0.1 * 0.49, 1e-3);
}

TEST(Refraction, AdjointEqualsCentralDifferences) {
  Random random(5);
  double worst = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double eta = random.between(1.1, 2.0);
    const Eigen::Vector3d n = random.near_z(std::numbers::pi);
    const Eigen::Vector3d a = turned_away(random, n, random.between(0.0, 0.9 * std::asin(1 / eta)));
    const Eigen::Vector3d b_bar = random.vector3();
    const double error = testing::plateau_error(
        refract_adjoint(a, n, eta, b_bar),
        [&](const Eigen::VectorXd& x) { return b_bar.dot(refract(a, x, eta)); }, n, 2e-4);
    ASSERT_LT(error, 1e-8);
    worst = std::max(worst, error);
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
}

TEST(Refraction, SlopeAdjointEqualsCentralDifferences) {
  Random random(6);
  double worst = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double eta = random.between(1.1, 2.0);
    const Eigen::Vector3d n = random.near_z(0.8 * std::asin(1.0 / eta));
    const Eigen::Vector2d m_bar = random.vector2();
    const double error = testing::plateau_error(
        RefractedBeam(n, eta).adjoint(n, eta, m_bar),
        [&](const Eigen::VectorXd& x) { return m_bar.dot(RefractedBeam(x, eta).m); }, n, 3e-4);
    ASSERT_LT(error, 1e-8);
    worst = std::max(worst, error);
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
}

}  // namespace
}  // namespace lensforge
