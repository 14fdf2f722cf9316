// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "design/energy/smoothness.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

using testing::Random;

NeighbourOffset offset_between(const FaceFrame& i, const FaceFrame& j) {
  return {i, TangentBasis(i.n), j};
}

/// At random, with its neighbour no nearer than 0.5.
NeighbourOffset random_offset(Random& random) {
  const double angle = random.between(-3.0, 3.0);
  const double length = random.between(0.5, 2.0);
  return {{length * std::cos(angle), length * std::sin(angle)}, random.vector2()};
}

TEST(Weingarten, NeighbourOffsetIsSeenInTheFacesOwnBasis) {
  const FaceFrame i{{0.0, 1.0, 0.0}, {1.0, 1.0, 5.0}};  // e1 = x, e2 = −z
  const FaceFrame j{{0.1, 0.9, 0.2}, {3.0, 4.0, 9.0}};
  const NeighbourOffset offset = offset_between(i, j);
  EXPECT_EQ(offset.d, Eigen::Vector2d(2.0, -4.0));
  EXPECT_EQ(offset.n, Eigen::Vector2d(0.1, -0.2));
}

TEST(Weingarten, MismatchIsZeroForTheMapOfASphere) {
  // On a sphere of radius R around the origin normals differ by 1/R times the points.
  const double radius = 40.0;
  Random random(1);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d here = random.near_z(0.5);
    const Eigen::Vector3d there = random.near_z(0.5);
    const WeingartenMap map{1.0 / radius, 1.0 / radius, 0.0};
    EXPECT_LT(offset_between({here, radius * here}, {there, radius * there}).mismatch(map), 1e-28);
    EXPECT_DOUBLE_EQ(map.mean_curvature(), 1.0 / radius);
  }
}

TEST(Weingarten, MismatchOfAFlatMapIsTheSquaredBend) {
  const FaceFrame i{{0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}};
  const FaceFrame j{{0.3, 0.4, 0.8}, {2.0, 0.0, 0.0}};
  EXPECT_NEAR(offset_between(i, j).mismatch({}), 0.25 / 4.0, 1e-15);
}

TEST(Weingarten, MismatchSlopeEqualsCentralDifferences) {
  Random random(2);
  double worst = 0.0;
  for (int k = 0; k < 300; ++k) {
    const NeighbourOffset offset = random_offset(random);
    const WeingartenMap m{random.between(-1.0, 1.0), random.between(-1.0, 1.0),
                          random.between(-1.0, 1.0)};
    const auto mismatch = [&](const Eigen::VectorXd& x) {
      return NeighbourOffset(x.head<2>(), x.tail<2>()).mismatch(m);
    };
    const MismatchSlope slope(offset, m);
    ASSERT_DOUBLE_EQ(slope.value, offset.mismatch(m));
    Eigen::VectorXd x(4);
    x << offset.d, offset.n;
    Eigen::VectorXd computed(4);
    computed << slope.by_d, slope.by_n;
    const double error = testing::plateau_error(computed, mismatch, x, 5e-4);
    ASSERT_LT(error, 1e-8);
    worst = std::max(worst, error);
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
}

TEST(Weingarten, WelschIsZeroAtRestAndSaturatesAtOne) {
  EXPECT_EQ(welsch(0.0, 0.3).value, 0.0);
  EXPECT_DOUBLE_EQ(welsch(0.0, 0.3).slope, 1.0 / (2.0 * 0.09));
  EXPECT_NEAR(welsch(2.0 * 0.09, 0.3).value, 1.0 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(welsch(100.0, 0.3).value, 1.0, 1e-15);
}

TEST(Weingarten, WelschSlopeEqualsCentralDifferences) {
  Random random(5);
  for (int k = 0; k < 100; ++k) {
    const double nu = random.magnitude(0.01, 10.0);
    const Eigen::VectorXd h = Eigen::VectorXd::Constant(1, random.between(0.1, 3.0) * nu * nu);
    const auto f = [&](const Eigen::VectorXd& x) { return welsch(x[0], nu).value; };
    const Eigen::VectorXd slope = Eigen::VectorXd::Constant(1, welsch(h[0], nu).slope);
    EXPECT_LT(testing::plateau_error(slope, f, h, 1e-3 * nu * nu), 1e-9);
  }
}

TEST(Weingarten, WelschLiesBelowItsTangents) {
  Random random(6);
  for (int k = 0; k < 100; ++k) {
    const double nu = random.magnitude(0.01, 10.0);
    const double h0 = random.between(0.0, 6.0) * nu * nu;
    const double h = random.between(0.0, 6.0) * nu * nu;
    const ValueSlope tangent = welsch(h0, nu);
    EXPECT_LE(welsch(h, nu).value, tangent.value + tangent.slope * (h - h0) + 1e-15);
  }
}

}  // namespace
}  // namespace lensforge
