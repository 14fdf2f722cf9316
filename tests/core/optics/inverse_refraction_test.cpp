// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/optics/refraction.h"
#include "design/random_input.h"
#include "design/snell.h"

namespace lensforge {
namespace {

using testing::Random;

/// Unit normal of a height field of this gradient.
Eigen::Vector3d normal_of(const Eigen::Vector2d& gradient) {
  return Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
}

/// Unit normal of a surface that lets parallel light along +z out.
Eigen::Vector3d transmitting_normal(Random& random, double eta) {
  return random.near_z(0.98 * std::asin(1.0 / eta));
}

TEST(InverseRefraction, UndoesTheRefractionOfASurface) {
  Random random(1);
  double worst = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double eta = random.between(1.05, 2.5);
    const Eigen::Vector3d n = transmitting_normal(random, eta);
    const Eigen::Vector2d expected = -n.head<2>() / n.z();
    const Eigen::Vector2d computed = refracting_gradient(RefractedBeam(n, eta).m, eta);
    worst = std::max(worst, (computed - expected).norm() / std::max(1.0, expected.norm()));
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
  EXPECT_LT(worst, 1e-12);
}

TEST(InverseRefraction, SendsLightWhereItIsWanted) {
  Random random(2);
  double worst = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double eta = random.between(1.05, 2.5);
    // A slope that some surface of this glass can bring about: the deflection is at most 90° less
    // the critical angle.
    const double largest = std::tan(std::acos(1.0 / eta));
    const double angle = random.between(0.0, 2.0 * std::numbers::pi);
    const Eigen::Vector2d m =
        random.between(0.0, 0.98 * largest) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d back = RefractedBeam(normal_of(refracting_gradient(m, eta)), eta).m;
    worst = std::max(worst, (back - m).norm() / std::max(1.0, m.norm()));
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
  EXPECT_LT(worst, 1e-12);
}

TEST(InverseRefraction, FollowsSnellsLaw) {
  Random random(3);
  for (int i = 0; i < 5000; ++i) {
    const double eta = random.between(1.05, 2.5);
    const Eigen::Vector2d m = testing::slope_by_angles(transmitting_normal(random, eta), eta);
    const Eigen::Vector3d n = normal_of(refracting_gradient(m, eta));
    const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
    EXPECT_NEAR(n.cross(b).norm(), eta * n.cross(Eigen::Vector3d::UnitZ()).norm(), 1e-13);
    EXPECT_LT((testing::slope_by_angles(n, eta) - m).norm(), 1e-11 * std::max(1.0, m.norm()));
  }
}

TEST(InverseRefraction, LightThatGoesStraightOnNeedsNoSlope) {
  EXPECT_EQ(refracting_gradient({0.0, 0.0}, 1.49), Eigen::Vector2d(0.0, 0.0));
}

TEST(InverseRefraction, SurfaceRisesTowardsWhereTheLightGoes) {
  const Eigen::Vector2d gradient = refracting_gradient({0.049, -0.098}, 1.49);
  EXPECT_NEAR(gradient.x(), 0.1, 2e-3);
  EXPECT_NEAR(gradient.y(), -0.2, 4e-3);
}

}  // namespace
}  // namespace lensforge
