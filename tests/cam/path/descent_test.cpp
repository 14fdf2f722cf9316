// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/path/collision.h"
#include "cam/path/rough.h"

namespace lensforge::descent_test {
namespace {

using ::testing::HasSubstr;

constexpr double kFeed = 500.0;
constexpr double kPlunge = 150.0;

/// A lens of 20 × 20 mm that rises along x by `slope`, in a blank 1 mm higher.
struct Bench {
  explicit Bench(double slope = 0.0)
      : surface(testing::grid_mesh(2, 2, 20.0, 20.0,
                                   [slope](double x, double) { return 6.0 + slope * x; })) {
    workshop.stock = {10.0, 1.0};
    tool.shape = CutterShape::kFlat;
    tool.diameter = 2.0;
    tool.flute_length = 40.0;
    tool.feed = kFeed;
    tool.plunge = kPlunge;
  }

  std::vector<SteepDescent> check(const std::vector<PathMove>& moves) {
    CollisionCheck check(surface, workshop, whole_blank(workshop, surface.bounds()));
    check.begin("rough", tool, rule);
    std::int64_t line = 10;
    for (const PathMove& move : moves) check.check(std::span(&move, 1), {0, ++line});
    return check.descents();
  }

  ProfileCutter surface;
  Workshop workshop;
  Tool tool;
  DescentRule rule;
};

PathMove rapid(double x, double y, double z) { return {MoveKind::kRapid, {x, y, z}}; }

PathMove feed(double x, double y, double z, double speed = kFeed) {
  PathMove move{MoveKind::kCut, {x, y, z}};
  move.feed = speed;
  return move;
}

TEST(Descent, FindsADiveAtTheCuttingFeed) {
  Bench bench;
  const auto found = bench.check({rapid(5, 5, 8), feed(5.1, 5, 4), feed(9, 5, 4)});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].first.line, 12);
  EXPECT_EQ(found[0].moves, 1);
  EXPECT_NEAR(found[0].angle_deg, 88.6, 0.1);
  EXPECT_EQ(found[0].feed, kFeed);
  EXPECT_NEAR(found[0].place.x(), 5.0, 0.11);
  EXPECT_EQ(found[0].sentence("rough.ngc"),
            "rough.ngc line 12: in 'rough' tool 1 goes down into material at 89 degrees and F500, "
            "at x 5.03 y 5.00; steeper than its ramp of 3 degrees it may only at its plunge feed, "
            "F150");
}

TEST(Descent, APlungeAtItsFeedIsRight) {
  Bench bench;
  EXPECT_TRUE(bench.check({rapid(5, 5, 8), feed(5, 5, 4, kPlunge), feed(9, 5, 4)}).empty());
}

TEST(Descent, TheRampAngleIsTheLimit) {
  for (const double ramp : {1.0, 3.0, 20.0}) {
    Bench bench;
    bench.rule.ramp_angle_deg = ramp;
    const auto down = [&](double degrees) {
      const double sink = 8.0 * std::tan(degrees * std::numbers::pi / 180.0);
      return bench.check({rapid(2, 5, 7), feed(10, 5, 7 - sink)});
    };
    EXPECT_TRUE(down(ramp).empty()) << ramp;
    EXPECT_EQ(down(ramp + 2.5).size(), 1U) << ramp;
  }
}

TEST(Descent, ThroughWhatIsCutAlreadyIsAir) {
  Bench bench;
  const PathMove up = rapid(9, 5, 12);
  EXPECT_TRUE(bench
                  .check({rapid(5, 5, 8), feed(5, 5, 4, kPlunge), feed(9, 5, 4), up,
                          feed(7, 5, 4.0), rapid(7, 5, 12), feed(6, 5, 4)})
                  .empty());
  EXPECT_EQ(
      bench.check({rapid(5, 5, 8), feed(5, 5, 4, kPlunge), feed(9, 5, 4), up, feed(9, 5, 3.5)})
          .size(),
      1U);
}

TEST(Descent, FollowsTheSurfaceAndNoSteeper) {
  for (const double slope : {0.1, 0.4, 0.8}) {
    Bench bench(slope);
    bench.workshop.stock = {10.0, 20.0};
    const double top = bench.surface.bounds().max().z();
    const auto along = [&](double fall) {
      return bench.check({rapid(31, 5, top), feed(19, 5, top), feed(2, 5, top - 17.0 * fall)});
    };
    EXPECT_TRUE(along(slope).empty()) << slope;
    EXPECT_EQ(along(slope + 0.12).size(), 1U) << slope;
  }
}

TEST(Descent, BesideTheSurfaceThereIsNothingToFollow) {
  Bench bench(0.8);
  EXPECT_EQ(bench.check({rapid(12, -8, 25), feed(12, -8, 20), feed(11, -8, 18.5)}).size(), 1U);
}

TEST(Descent, SmallStepsDownAddUp) {
  Bench bench;
  std::vector<PathMove> stairs{rapid(2, 5, 7)};
  for (int k = 1; k <= 20; ++k) {
    stairs.push_back(feed(2 + 0.1 * k, 5, 7 - 0.05 * (k - 1)));
    stairs.push_back(feed(2 + 0.1 * k, 5, 7 - 0.05 * k));
  }
  const auto found = bench.check(stairs);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_GT(found[0].moves, 3);
  EXPECT_THAT(found[0].sentence("a.ngc"), HasSubstr(" more moves"));
}

TEST(Descent, AnArcThatSinksIsLookedAtAlongItsWay) {
  Bench bench;
  PathMove arc = feed(10, 5, 7);
  arc.arc_axis = 1;
  arc.centre = {7, 5, 7};
  for (const bool clockwise : {false, true}) {
    arc.clockwise = clockwise;
    const std::vector<PathMove> moves{rapid(-15, 5, 7), feed(4, 5, 7), arc};
    EXPECT_EQ(bench.check(moves).empty(), !clockwise) << "the other one goes over the top";
  }
}

}  // namespace
}  // namespace lensforge::descent_test
