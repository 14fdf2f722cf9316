// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "cam/milled/ball_sweep.h"
#include "cam/milled_paths.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;

std::vector<std::int32_t> pieces_of(const BallPath& path) {
  std::vector<std::int32_t> pieces;
  for (const BallMove& move : path.moves()) pieces.push_back(move.piece);
  return pieces;
}

TEST(BallPath, LiftsTheTipToTheCentreAndTakesOffTheProgramsZero) {
  BallPath path(kRadius, -6.0);
  testing::add_polyline(path, {{1, 2, -0.5}, {3, 2, -0.25}});
  ASSERT_EQ(path.moves().size(), 1U);
  EXPECT_NEAR((path.moves()[0].start - Eigen::Vector3d(1, 2, 5.7)).norm(), 0.0, 1e-15);
  EXPECT_NEAR((path.moves()[0].end - Eigen::Vector3d(3, 2, 5.95)).norm(), 0.0, 1e-15);
}

TEST(BallPath, EveryRowOfAZigZagIsAPieceOfItsOwn) {
  BallPath path(kRadius, 0.0);
  testing::add_polyline(path, {{0, 0, 0},
                               {1, 0, 0},
                               {2, 0, 0.001},
                               {2, 0.06, 0},
                               {1, 0.06, 0},
                               {0, 0.06, 0},
                               {0, 0.12, 0},
                               {1, 0.12, 0}});
  EXPECT_EQ(pieces_of(path), (std::vector<std::int32_t>{0, 0, 1, 2, 2, 3, 4}));
  EXPECT_EQ(path.pieces(), 5);
}

TEST(BallPath, RowsThatARoundLinkJoinsAreTwoPieces) {
  BallPath path(kRadius, 0.0);
  testing::add_polyline(path, {{0, 0, 0}, {2, 0, 0}});
  path.add(testing::arc_motion(ArcPlane::kXY, false, {2, 0, 0}, {2, 0.06, 0}, {0, 0.03, 0}));
  testing::add_polyline(path, {{2, 0.06, 0}, {0, 0.06, 0}});
  EXPECT_NE(path.moves().front().piece, path.moves().back().piece);
}

TEST(BallPath, APieceEndsOnARidgeAndRunsOnThroughAValleyAndAGentleHill) {
  BallPath path(kRadius, 0.0);
  testing::add_polyline(path, {{0, 0, 0}, {1, 0, -0.1}, {2, 0, 0}, {2.5, 0, 0.049}, {3, 0, 0}});
  EXPECT_EQ(pieces_of(path), (std::vector<std::int32_t>{0, 0, 0, 1}));
}

TEST(BallPath, ABallThatRollsOverARidgeInSmallStepsBeginsANewPiece) {
  // The tip's way over an edge: a ball of the radius around it, in steps of 0.002 rad.
  BallPath path(kRadius, 0.0);
  std::vector<Eigen::Vector3d> tips{{-1, 0, -0.05}};
  for (int k = -25; k <= 25; ++k) {
    const double angle = 0.002 * k;
    tips.emplace_back(kRadius * std::sin(angle), 0, kRadius * (std::cos(angle) - 1.0));
  }
  tips.emplace_back(1, 0, -0.05);
  testing::add_polyline(path, tips);
  EXPECT_NE(path.moves().front().piece, path.moves().back().piece);
}

TEST(BallPath, AnArcOverARidgeSeparatesWhatLiesBesideIt) {
  BallPath path(kRadius, 0.0);
  const double a = 0.1;
  const Eigen::Vector3d left(-kRadius * std::sin(a), 0, kRadius * (std::cos(a) - 1));
  const Eigen::Vector3d right(-left.x(), 0, left.z());
  const Eigen::Vector3d far_left = left - Eigen::Vector3d(std::cos(a), 0, std::sin(a));
  const Eigen::Vector3d far_right = right + Eigen::Vector3d(std::cos(a), 0, -std::sin(a));
  testing::add_polyline(path, {far_left, left});
  path.add(testing::arc_motion(ArcPlane::kZX, false, left, right,
                               Eigen::Vector3d(0, 0, -kRadius) - left));
  testing::add_polyline(path, {right, far_right});
  const auto pieces = pieces_of(path);
  ASSERT_EQ(pieces.size(), 3U);
  EXPECT_EQ(std::set<std::int32_t>(pieces.begin(), pieces.end()).size(), 3U);
}

TEST(BallPath, SplitsArcsIntoThirdsOfATurnThatJoin) {
  BallPath path(kRadius, 0.0);
  path.add(testing::arc_motion(ArcPlane::kXY, true, {1, 0, 0}, {1, 0, 0}, {-1, 0, 0}));
  ASSERT_EQ(path.arcs().size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(path.arcs()[k].sweep, -2.0 * std::numbers::pi / 3.0, 1e-12);
    const BallMove& next = path.moves()[(k + 1) % 3];
    EXPECT_NEAR((path.moves()[k].end - next.start).norm(), 0.0, 1e-15);
  }
}

TEST(BallPath, ChordsOfAHelixStayWithinTheirErrorOfIt) {
  BallPath path(kRadius, 0.0);
  const GcodeMotion helix =
      testing::arc_motion(ArcPlane::kXY, false, {1, 0, 0.5}, {1, 0, 0}, {-1, 0, 0});
  path.add(helix);
  double worst = 0.0;
  for (const BallMove& move : path.moves()) {
    const Eigen::Vector3d middle = 0.5 * (move.start + move.end);
    worst = std::max(worst, 1.0 - middle.head<2>().norm());
  }
  EXPECT_LE(worst, BallPath::kHelixError);
  EXPECT_GE(worst, 0.5 * BallPath::kHelixError);
  EXPECT_NEAR(path.moves().back().end.z(), kRadius, 1e-12);
}

}  // namespace
}  // namespace lensforge
