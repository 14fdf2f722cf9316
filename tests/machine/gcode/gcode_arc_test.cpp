// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "machine/gcode/gcode_motion.h"

namespace lensforge {
namespace {

constexpr double kPi = std::numbers::pi;
using Eigen::Vector3d;

ArcRequest request(bool clockwise, const Vector3d& offset) {
  ArcRequest made;
  made.clockwise = clockwise;
  made.offset = offset;
  return made;
}

TEST(Arc, QuarterTurnFromItsCentre) {
  const auto [arc, reason] = make_arc({1, 0, 0}, {0, 1, 0.5}, request(false, {-1, 0, 0}));
  ASSERT_EQ(reason, "");
  EXPECT_NEAR(arc.radius, 1.0, 1e-15);
  EXPECT_NEAR(arc.sweep, 0.5 * kPi, 1e-15);
  EXPECT_NEAR((arc.at(0.5) - Vector3d(std::sqrt(0.5), std::sqrt(0.5), 0.25)).norm(), 0.0, 1e-15);
  EXPECT_NEAR(arc.length(), std::hypot(0.5 * kPi, 0.5), 1e-15);
}

TEST(Arc, ClockwiseGoesTheOtherWayRound) {
  const auto [arc, reason] = make_arc({1, 0, 0}, {0, 1, 0}, request(true, {-1, 0, 0}));
  ASSERT_EQ(reason, "");
  EXPECT_NEAR(arc.sweep, -1.5 * kPi, 1e-15);
}

TEST(Arc, EqualPointsAreAFullCircle) {
  for (const bool clockwise : {false, true}) {
    const auto [arc, reason] = make_arc({3, 4, 1}, {3, 4, 1}, request(clockwise, {0, 2, 0}));
    ASSERT_EQ(reason, "");
    EXPECT_NEAR(arc.sweep, clockwise ? -2 * kPi : 2 * kPi, 1e-12);
    EXPECT_NEAR((arc.bounds().min() - Vector3d(1, 4, 1)).norm(), 0.0, 1e-12);
    EXPECT_NEAR((arc.bounds().max() - Vector3d(5, 8, 1)).norm(), 0.0, 1e-12);
  }
}

TEST(Arc, PlanesTurnAsSeenFromTheirThirdAxis) {
  // Counter-clockwise seen from +Y: Z towards X (G18); seen from +X: Y towards Z (G19).
  ArcRequest zx = request(false, {0, 0, -1});
  zx.plane = ArcPlane::kZX;
  const auto g18 = make_arc({0, 0, 1}, {1, 0, 0}, zx);
  ASSERT_EQ(g18.reason, "");
  EXPECT_NEAR(g18.arc.sweep, 0.5 * kPi, 1e-15);
  ArcRequest yz = request(false, {0, -1, 0});
  yz.plane = ArcPlane::kYZ;
  const auto g19 = make_arc({0, 1, 0}, {0, 0, 1}, yz);
  ASSERT_EQ(g19.reason, "");
  EXPECT_NEAR(g19.arc.sweep, 0.5 * kPi, 1e-15);
}

/// Random arcs: begin and end lie where asked, every point at the radius, and the sign of R says
/// which of the two arcs is meant.
TEST(Arc, RadiusFormMeetsItsPointsAndItsHalf) {
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> anywhere(-50.0, 50.0);
  for (int i = 0; i < 2000; ++i) {
    ArcRequest asked;
    asked.plane = static_cast<ArcPlane>(engine() % 3);
    asked.clockwise = engine() % 2 == 0;
    const Vector3d start(anywhere(engine), anywhere(engine), anywhere(engine));
    const Vector3d end(anywhere(engine), anywhere(engine), anywhere(engine));
    const double sign = engine() % 2 == 0 ? 1.0 : -1.0;
    asked.radius = sign * ((end - start).norm() * 0.51 + 1.0);
    const auto [arc, reason] = make_arc(start, end, asked);
    ASSERT_EQ(reason, "");
    ASSERT_NEAR((arc.at(0.0) - start).norm(), 0.0, 1e-9);
    ASSERT_NEAR((arc.at(1.0) - end).norm(), 0.0, 1e-9);
    ASSERT_EQ(arc.sweep < 0.0, asked.clockwise);
    ASSERT_EQ(std::abs(arc.sweep) <= kPi, *asked.radius > 0.0);
    for (double part = 0.0; part <= 1.0; part += 0.05) {
      Eigen::AlignedBox3d grown = arc.bounds();
      grown.min().array() -= 1e-9;
      grown.max().array() += 1e-9;
      ASSERT_TRUE(grown.contains(arc.at(part)));
    }
  }
}

TEST(Arc, BoundsAreTightToTheSamples) {
  std::mt19937_64 engine(4);
  std::uniform_real_distribution<double> anywhere(-5.0, 5.0);
  for (int i = 0; i < 200; ++i) {
    ArcRequest asked;
    asked.clockwise = engine() % 2 == 0;
    const Vector3d start(anywhere(engine), anywhere(engine), 0.0);
    const Vector3d end(anywhere(engine), anywhere(engine), 1.0);
    asked.radius = (engine() % 2 == 0 ? 1.0 : -1.0) * ((end - start).norm() * 0.51);
    const auto [arc, reason] = make_arc(start, end, asked);
    ASSERT_EQ(reason, "");
    Eigen::AlignedBox3d samples;
    for (int k = 0; k <= 5000; ++k) samples.extend(arc.at(k / 5000.0));
    ASSERT_NEAR((samples.min() - arc.bounds().min()).norm(), 0.0, 1e-4);
    ASSERT_NEAR((samples.max() - arc.bounds().max()).norm(), 0.0, 1e-4);
  }
}

TEST(Arc, RefusesWhatIsNoCircle) {
  EXPECT_NE(make_arc({1, 0, 0}, {0, 1.1, 0}, request(false, {-1, 0, 0})).reason, "");
  EXPECT_EQ(make_arc({1, 0, 0}, {0, 1.004, 0}, request(false, {-1, 0, 0})).reason, "");
  EXPECT_EQ(make_arc({100, 0, 0}, {0, 100.09, 0}, request(false, {-100, 0, 0})).reason, "");
  EXPECT_NE(make_arc({100, 0, 0}, {0, 100.2, 0}, request(false, {-100, 0, 0})).reason, "");
  EXPECT_NE(make_arc({1, 0, 0}, {0, 1, 0}, request(false, {0, 0, 0})).reason, "");
  EXPECT_NE(make_arc({1, 0, 0}, {0, 1, 0}, request(false, {-1, 0, 1})).reason, "");
  ArcRequest radius;
  radius.radius = 1.0;
  EXPECT_NE(make_arc({0, 0, 0}, {3, 0, 0}, radius).reason, "");
  EXPECT_NE(make_arc({0, 0, 0}, {0, 0, 1}, radius).reason, "");
  EXPECT_EQ(make_arc({0, 0, 0}, {2, 0, 0}, radius).reason, "");
}

}  // namespace
}  // namespace lensforge
