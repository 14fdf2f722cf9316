// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/weingarten.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "design/finite_difference.h"
#include "design/random_corners.h"

namespace lensforge {
namespace {

using testing::Random;

/// A frame as a triangle of random_corners() would have it, unit vectors at right angles.
FaceFrame random_frame(Random& random) { return face_frame(testing::random_corners(random)); }

Eigen::VectorXd pack(const FaceFrame& i, const FaceFrame& j, const WeingartenMap& m) {
  Eigen::VectorXd x(21);
  x << i.n, i.e1, i.c, j.n, j.e1, j.c, m.a, m.b, m.c;
  return x;
}

double mismatch_at(const Eigen::VectorXd& x) {
  const FaceFrame i{x.segment<3>(0), x.segment<3>(3), x.segment<3>(6)};
  const FaceFrame j{x.segment<3>(9), x.segment<3>(12), x.segment<3>(15)};
  return NeighbourOffset(i, j).mismatch({x[18], x[19], x[20]});
}

TEST(Weingarten, NeighbourOffsetIsSeenInTheFacesOwnBasis) {
  const FaceFrame i{{0.0, 0.0, 1.0}, {0.0, 1.0, 0.0}, {1.0, 1.0, 5.0}};
  const FaceFrame j{{0.1, 0.2, 0.9}, {1.0, 0.0, 0.0}, {3.0, 4.0, 9.0}};
  // e2 = n × e1 = (−1, 0, 0)
  const NeighbourOffset offset(i, j);
  EXPECT_EQ(offset.d, Eigen::Vector2d(3.0, -2.0));
  EXPECT_EQ(offset.n, Eigen::Vector2d(0.2, -0.1));
}

TEST(Weingarten, MismatchIsZeroForTheMapOfASphere) {
  // On a sphere of radius R around the origin normals differ by 1/R times the points.
  const double radius = 40.0;
  const auto frame = [&](const Eigen::Vector3d& n, const Eigen::Vector3d& e1) {
    return FaceFrame{n, e1, radius * n};
  };
  Random random(1);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d n = random.near_z(0.5);
    const FaceFrame i = frame(n, n.cross(random.vector3()).normalized());
    const FaceFrame j = frame(random.near_z(0.5), Eigen::Vector3d::UnitX());
    const WeingartenMap map{1.0 / radius, 1.0 / radius, 0.0};
    EXPECT_LT(NeighbourOffset(i, j).mismatch(map), 1e-28);
    EXPECT_DOUBLE_EQ(map.mean_curvature(), 1.0 / radius);
  }
}

TEST(Weingarten, MismatchOfAFlatMapIsTheSquaredBend) {
  const FaceFrame i{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  const FaceFrame j{{0.3, 0.4, 0.8}, {1.0, 0.0, 0.0}, {2.0, 0.0, 0.0}};
  EXPECT_NEAR(NeighbourOffset(i, j).mismatch({}), 0.25 / 4.0, 1e-15);
}

TEST(Weingarten, MismatchAdjointEqualsCentralDifferences) {
  Random random(2);
  double worst = 0.0;
  for (int k = 0; k < 300; ++k) {
    const FaceFrame i = random_frame(random);
    FaceFrame j = random_frame(random);
    j.c = i.c + random.vector3().normalized() + 0.5 * i.e1;
    if (NeighbourOffset(i, j).d.norm() < 0.5) continue;
    const WeingartenMap m{random.between(-1.0, 1.0), random.between(-1.0, 1.0),
                          random.between(-1.0, 1.0)};
    CurvedFace i_bar;
    FaceFrame j_bar;
    const double value = mismatch_adjoint({i, m}, j, 1.0, i_bar, j_bar);
    ASSERT_DOUBLE_EQ(value, NeighbourOffset(i, j).mismatch(m));
    const double error = testing::plateau_error(pack(i_bar.frame, j_bar, i_bar.map), mismatch_at,
                                                pack(i, j, m), 5e-4);
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
