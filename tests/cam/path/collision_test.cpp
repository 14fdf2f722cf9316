// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/collision.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/path/operation.h"
#include "cam/path/rough.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;

/// A plane lens at z = 6 in a blank of 1 mm more, and 10 mm beyond it all around.
struct Bench {
  explicit Bench(std::vector<KeepOut> boxes = {})
      : surface(testing::grid_mesh(2, 2, 20.0, 20.0, [](double, double) { return 6.0; })) {
    workshop.stock = {10.0, 1.0};
    workshop.keep_outs = std::move(boxes);
    tool.number = 5;
    tool.diameter = 1.0;
    tool.flute_length = 2.0;
    tool.sections = {{4.0, 3.0, 10.0}, {12.0, 10.0, 30.0}};
  }

  std::vector<Collision> check(const std::vector<PathMove>& moves) {
    CollisionCheck check(surface, workshop, whole_blank(workshop, surface.bounds()));
    check.begin("finish", tool);
    check.check(moves);
    return check.collisions();
  }

  ProfileCutter surface;
  Workshop workshop;
  Tool tool;
};

PathMove to(MoveKind kind, double x, double y, double z) {
  return {kind, Eigen::Vector3d(x, y, z)};
}

TEST(Collision, FindsNoneAboveTheBlankOrInItsCut) {
  Bench bench;
  EXPECT_TRUE(bench
                  .check({to(MoveKind::kRapid, -20, 5, 12), to(MoveKind::kRapid, 40, 5, 12),
                          to(MoveKind::kRapid, 40, 6, 6), to(MoveKind::kCut, -20, 6, 6),
                          to(MoveKind::kRapid, -20, 6, 12)})
                  .empty());
}

TEST(Collision, FindsTheTableUnderTheBlankAndBesideIt) {
  Bench bench;
  bench.tool.flute_length = 40.0;
  bench.tool.sections.clear();
  EXPECT_TRUE(bench.check({to(MoveKind::kRapid, -20, 5, 0), to(MoveKind::kCut, 5, 5, 0)}).empty());
  for (const MoveKind kind : {MoveKind::kRapid, MoveKind::kCut}) {
    const auto beside = bench.check({to(MoveKind::kRapid, -20, 5, 1), to(kind, -20, 5, -0.37)});
    ASSERT_EQ(beside.size(), 1u);
    EXPECT_EQ(beside[0].obstacle, kTableObstacle);
    EXPECT_NEAR(beside[0].worst.value, 0.37, 1e-8);
  }
  // An arc that hangs below its ends.
  PathMove arc = to(MoveKind::kCut, 6, 5, 0.5);
  arc.arc_axis = 1;
  arc.centre = {5, 5, 0.5};
  arc.clockwise = false;
  const auto hangs = bench.check({to(MoveKind::kCut, 4, 5, 0.5), arc});
  PathMove cap = arc;
  cap.clockwise = true;
  const auto rises = bench.check({to(MoveKind::kCut, 4, 5, 0.5), cap});
  EXPECT_EQ(hangs.empty(), !rises.empty());
  const auto& below = hangs.empty() ? rises : hangs;
  ASSERT_EQ(below.size(), 1u);
  EXPECT_NEAR(below[0].worst.value, 0.5, 0.01);
}

TEST(Collision, FindsTheToolAboveItsFlutes) {
  Bench bench;
  // 2.5 mm below the top of the blank with flutes of 2 mm.
  const auto found =
      bench.check({to(MoveKind::kRapid, -20, 5, 4.5), to(MoveKind::kCut, 5, 5, 4.5)});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].part, "tool above its flutes");
  EXPECT_EQ(found[0].obstacle, "the blank");
  EXPECT_NEAR(found[0].worst.value, 0.5, 1e-9);
  EXPECT_NEAR(found[0].first_place.x(), -10.5, 0.11);
  EXPECT_EQ(found[0].moves, 1);
  EXPECT_THAT(found[0].sentence(),
              HasSubstr("in 'finish' tool 5 (tool above its flutes) touches the blank in 1 move"));
}

TEST(Collision, FindsTheShankBesideADeepSlot) {
  Bench bench;
  bench.tool.flute_length = 5.0;
  bench.tool.sections = {{4.0, 5.0, 10.0}, {12.0, 10.0, 30.0}};
  const auto slot = [&](double z) {
    return bench.check({to(MoveKind::kRapid, -20, 5, z), to(MoveKind::kCut, 30, 5, z)});
  };
  EXPECT_TRUE(slot(2.01).empty());
  const auto found = slot(1.5);
  ASSERT_EQ(found.size(), 2u);
  const auto shank = std::find_if(found.begin(), found.end(),
                                  [](const Collision& c) { return c.part == "section of 4.0 mm"; });
  ASSERT_NE(shank, found.end());
  EXPECT_NEAR(shank->worst.value, 0.5, 1e-9);
  EXPECT_NEAR(shank->first_place.x(), -12.0, 0.11);
}

TEST(Collision, TellsTheLensFromTheBlank) {
  Bench bench;
  const auto found = bench.check({to(MoveKind::kRapid, -20, 5, 3.5), to(MoveKind::kCut, -5, 5, 3.5),
                                  to(MoveKind::kCut, 5, 5, 3.5)});
  ASSERT_FALSE(found.empty());
  std::vector<std::string> met;
  met.reserve(found.size());
  for (const Collision& one : found) met.push_back(one.part + " " + one.obstacle);
  EXPECT_THAT(met, ::testing::Contains("tool above its flutes the lens"));
  EXPECT_THAT(met, ::testing::Contains("tool above its flutes the blank"));
}

TEST(Collision, FindsRapidsThroughMaterial) {
  Bench bench;
  const auto found =
      bench.check({to(MoveKind::kRapid, -20, 5, 6.8), to(MoveKind::kRapid, 30, 5, 6.8)});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].part, "cutter");
  EXPECT_EQ(found[0].obstacle, "the blank");
  EXPECT_NEAR(found[0].worst.value, 0.15, 1e-9);
  // Where a cut was made before, the rapid goes through air; the cells beside it are spared.
  EXPECT_TRUE(bench
                  .check({to(MoveKind::kRapid, -20, 5, 6.8), to(MoveKind::kCut, 30, 5, 6.8),
                          to(MoveKind::kRapid, 30, 5, 9.0), to(MoveKind::kRapid, -20, 5, 9.0)})
                  .empty());
}

TEST(Collision, FindsKeepOutBoxesWithEveryPartOfTheTool) {
  const KeepOut box{"vice", {50.5, 0.0, 0.0}, {60.0, 20.0, 14.0}};
  Bench bench({box});
  const auto pass = [&](double x, double z) {
    return bench.check({to(MoveKind::kRapid, x, -30, z), to(MoveKind::kRapid, x, 50, z)});
  };
  EXPECT_TRUE(pass(51.0, 14.01).empty());
  const auto cutter = pass(51.0, 13.5);
  ASSERT_FALSE(cutter.empty());
  EXPECT_EQ(cutter[0].obstacle, "the keep-out box 'vice'");
  EXPECT_EQ(cutter[0].part, "cutter");
  EXPECT_NEAR(cutter[0].worst.value, 0.5, 1e-9);
  // 1.9 mm beside the box only the shank of 4 mm reaches it, 4.1 beside only the holder of 12.
  ASSERT_EQ(pass(48.6, 10.5).size(), 1u);
  EXPECT_EQ(pass(48.6, 10.5)[0].part, "section of 4.0 mm");
  EXPECT_TRUE(pass(48.6, 11.01).empty());
  ASSERT_EQ(pass(46.4, 3.9).size(), 1u);
  EXPECT_EQ(pass(46.4, 3.9)[0].part, "section of 12.0 mm");
  EXPECT_TRUE(pass(44.3, 3.9).empty());
}

TEST(Collision, FollowsArcs) {
  const KeepOut box{"pin", {9.0, 14.0, 0.0}, {11.0, 16.0, 20.0}};
  Bench bench({box});
  PathMove arc = to(MoveKind::kRapid, 15, 10, 15);
  arc.arc_axis = 2;
  arc.centre = {10, 10, 15};
  arc.clockwise = true;  // From (5, 10) over (10, 15), through the pin.
  ASSERT_FALSE(bench.check({to(MoveKind::kRapid, 5, 10, 15), arc}).empty());
  arc.clockwise = false;  // Over (10, 5).
  bench.tool.sections.clear();
  EXPECT_TRUE(bench.check({to(MoveKind::kRapid, 5, 10, 15), arc}).empty());
}

TEST(Collision, DefaultRoughingAndSemiFinishingTouchNothing) {
  const SurfaceMesh mesh = testing::grid_mesh(61, 51, 10.0, 8.0, [](double x, double y) {
    return testing::lens_relief(x + 30.0, y + 20.0);
  });
  for (const double margin : {0.0, 3.0, 12.0}) {
    Workshop workshop;
    workshop.stock.margin = margin;
    const ProfileCutter surface(mesh);
    StockMap stock = whole_blank(workshop, surface.bounds());
    CollisionCheck check(surface, workshop, stock);
    const MoveSink sink = [&](std::span<const PathMove> moves) { check.check(moves); };
    check.begin("rough", workshop.tool(3));
    (void)cut_rough({surface, workshop, stock}, Executor::serial(), sink, RunControl{});
    check.begin("semi", workshop.tool(2));
    (void)cut_semi({surface, workshop, stock}, Executor::serial(), sink, RunControl{});
    for (const Collision& one : check.collisions()) ADD_FAILURE() << margin << one.sentence();
  }
}

TEST(MovePieces, CoverALineAndAnArc) {
  std::vector<MovePiece> pieces;
  const auto take = [&](const MovePiece& piece) { pieces.push_back(piece); };
  split_move({0, 0, 1}, to(MoveKind::kCut, 3, 4, 1), 1.0, take);
  ASSERT_EQ(pieces.size(), 5u);
  EXPECT_NEAR(pieces[2].reach, 0.5, 1e-12);
  EXPECT_EQ(pieces[4].to, Eigen::Vector3d(3, 4, 1));

  // A half circle below its ends, in the plane y = 2: seen from +y, z is to the right of x.
  pieces.clear();
  PathMove arc = to(MoveKind::kCut, 1, 2, 5);
  arc.arc_axis = 1;
  arc.centre = {0, 2, 5};
  for (const bool clockwise : {false, true}) {
    pieces.clear();
    arc.clockwise = clockwise;
    split_move({-1, 2, 5}, arc, 0.1, take);
    ASSERT_EQ(pieces.size(), 32u);
    const Eigen::Vector3d middle = pieces[15].to;
    EXPECT_NEAR(middle.x(), 0.0, 1e-12);
    // Counter-clockwise about +y turns z into x and so −x into z.
    EXPECT_NEAR(middle.z(), clockwise ? 4.0 : 6.0, 1e-12);
    for (const MovePiece& piece : pieces) {
      EXPECT_LE(piece.lowest, std::min(piece.from.z(), piece.to.z()));
      EXPECT_NEAR(std::hypot(piece.to.x(), piece.to.z() - 5.0), 1.0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace lensforge
