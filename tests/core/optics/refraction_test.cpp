// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/refraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/compute/scalar.h"
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

TEST(Fresnel, AcrylicLetsThroughWhatFormulasByAnglesSay) {
  for (double degrees = 1.0; degrees < 42.0; degrees += 1.0) {
    const double i = degrees * kDegree;
    const double t = std::asin(1.49 * std::sin(i));
    const double across = std::sin(i - t) / std::sin(i + t);
    const double along = std::tan(i - t) / std::tan(i + t);
    const double expected = 1.0 - 0.5 * (across * across + along * along);
    EXPECT_NEAR(transmittance(std::cos(i), 1.49).value, expected, 1e-12) << degrees;
  }
  EXPECT_NEAR(transmittance(1.0, 1.49).value, 1.0 - std::pow(0.49 / 2.49, 2), 1e-15);
}

TEST(Fresnel, LightAlongThePolarisingAngleLosesOnePolarisationAlone) {
  const double i = std::atan(1.0 / 1.5);
  const double t = 0.5 * std::numbers::pi - i;
  const double across = std::sin(i - t);
  EXPECT_NEAR(transmittance(std::cos(i), 1.5).value, 1.0 - 0.5 * across * across, 1e-12);
}

TEST(Fresnel, NothingPassesBeyondTheCriticalAngle) {
  const double critical = std::sqrt(1.0 - 1.0 / (1.49 * 1.49));
  EXPECT_EQ(transmittance(critical - 1e-9, 1.49).value, 0.0);
  EXPECT_LT(transmittance(critical + 1e-9, 1.49).value, 1e-3);
  EXPECT_EQ(transmittance(-0.9, 1.49).value, 0.0);
}

TEST(Fresnel, SlopeEqualsCentralDifferences) {
  for (double c = 0.76; c < 0.999; c += 0.01) {
    const double h = 1e-6;
    const double expected =
        (transmittance(c + h, 1.49).value - transmittance(c - h, 1.49).value) / (2.0 * h);
    EXPECT_NEAR(transmittance(c, 1.49).slope, expected, 1e-8 * (1.0 + std::abs(expected)));
  }
}

TEST(Fresnel, TwoReflectionsOfAcrylicAreAThousandthAndAHalf) {
  EXPECT_NEAR(ghost_share(1.49), std::pow(0.49 / 2.49, 4), 1e-15);
}

TEST(ReflectionBarrier, IsTheInverseSquareCosineOfTheRefractedAngle) {
  for (const double incidence : {0.0, 0.2, 0.5, 0.7}) {
    const double refracted = std::asin(1.49 * std::sin(incidence));
    EXPECT_NEAR(reflection_barrier(std::cos(incidence), 1.49).value,
                1.0 / std::pow(std::cos(refracted), 2), 1e-12);
  }
}

TEST(ReflectionBarrier, IsInfiniteBeyondTheCriticalAngle) {
  const double critical = std::asin(1.0 / 1.49);
  EXPECT_TRUE(std::isfinite(reflection_barrier(std::cos(critical - 1e-9), 1.49).value));
  EXPECT_EQ(reflection_barrier(std::cos(critical + 1e-9), 1.49).value, kInfinity);
  EXPECT_EQ(reflection_barrier(-1.0, 1.49).value, kInfinity);
  EXPECT_EQ(reflection_barrier(std::numeric_limits<double>::quiet_NaN(), 1.49).value, kInfinity);
}

TEST(ReflectionBarrier, SlopeEqualsCentralDifferences) {
  testing::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const double eta = random.between(1.1, 2.0);
    const double least = std::cos(0.9 * std::asin(1.0 / eta));
    const Eigen::VectorXd c = Eigen::VectorXd::Constant(1, random.between(least, 1.0));
    const auto f = [&](const Eigen::VectorXd& x) { return reflection_barrier(x[0], eta).value; };
    const Eigen::VectorXd slope = Eigen::VectorXd::Constant(1, reflection_barrier(c[0], eta).slope);
    EXPECT_LT(testing::plateau_error(slope, f, c, 1e-4), 1e-7);
  }
}

}  // namespace

}  // namespace lensforge
