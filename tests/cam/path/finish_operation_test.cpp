// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/path/finish_raster.h"

namespace lensforge::finish_operation_test {
namespace {

using ::testing::HasSubstr;

constexpr double kRadius = 0.2;
constexpr double kSide = 2.0;
constexpr double kSafe = 12.0;

SurfaceMesh relief() {
  return testing::grid_mesh(15, 16, kSide, kSide, [](double x, double y) {
    return testing::lens_relief(4.0 * x, 4.0 * y) + 0.3 * std::abs(x - 0.9 + 0.3 * y);
  });
}

FinishRun finish_run() {
  FinishRun run;
  run.tool.number = 3;
  run.tool.feed = 500.0;
  run.tool.plunge = 150.0;
  run.safe_z = kSafe;
  return run;
}

RasterPlan plan_of(PassStyle style, int along) {
  RasterOptions options;
  options.pitch = 0.1;
  options.style = style;
  options.along = along;
  options.arcs = true;
  return plan_finish_raster({Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kSide, kSide)}, kRadius,
                            options);
}

struct Cut {
  std::vector<PathMove> moves;
  OperationSummary summary;
};

Cut cut(const SurfaceMesh& mesh, const RasterPlan& plan) {
  const FacetCutSurface surface(mesh, kRadius, Executor::serial());
  Cut result;
  const MoveSink sink = [&](std::span<const PathMove> moves) {
    result.moves.insert(result.moves.end(), moves.begin(), moves.end());
  };
  result.summary = cut_finish(surface, plan, finish_run(), Executor::serial(), sink, {});
  return result;
}

TEST(FinishOperation, BeginsAndEndsAtTheSafeHeight) {
  for (const PassStyle style : {PassStyle::kZigzag, PassStyle::kClimb}) {
    const Cut result = cut(relief(), plan_of(style, 0));
    EXPECT_EQ(result.moves.front().kind, MoveKind::kRapid);
    EXPECT_EQ(result.moves.front().end.z(), kSafe);
    EXPECT_EQ(result.moves[1].kind, MoveKind::kPlunge);
    EXPECT_EQ(result.moves[1].feed, 150.0);
    EXPECT_EQ(result.moves.back().kind, MoveKind::kRapid);
    EXPECT_EQ(result.moves.back().end.z(), kSafe);
  }
}

TEST(FinishOperation, ToAndFroStaysAtFeedThroughout) {
  const Cut result = cut(relief(), plan_of(PassStyle::kZigzag, 1));
  const auto inner = std::span(result.moves).subspan(2, result.moves.size() - 3);
  for (const PathMove& move : inner) {
    EXPECT_EQ(move.kind, MoveKind::kCut);
    EXPECT_EQ(move.feed, 500.0);
  }
}

/// Down a wall of 0.6 mm, across the rows and along them.
TEST(FinishOperation, StraightMovesThatDiveAreMadeAtPlungeFeed) {
  const SurfaceMesh wall = testing::grid_mesh(15, 16, kSide, kSide, [](double x, double y) {
    return 5.0 - 0.6 * std::clamp(5.0 * (x + y - 2.0), 0.0, 1.0);
  });
  for (const int along : {0, 1}) {
    const Cut result = cut(wall, plan_of(PassStyle::kZigzag, along));
    int dives = 0;
    Eigen::Vector3d at = result.moves.front().end;
    for (const PathMove& move : result.moves) {
      const Eigen::Vector3d way = move.end - at;
      const double run = way.head<2>().norm();
      if (move.kind != MoveKind::kRapid && move.arc_axis < 0 && -way.z() > std::max(0.05, run)) {
        EXPECT_EQ(move.feed, 150.0);
        ++dives;
      }
      at = move.end;
    }
    EXPECT_GT(dives, 2);
  }
}

/// Nothing but cuts comes near the part, and ways back run over the row that was just cut.
TEST(FinishOperation, LinksNeverTouchThePart) {
  const SurfaceMesh mesh = relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  for (const PassStyle style : {PassStyle::kZigzag, PassStyle::kClimb, PassStyle::kConventional}) {
    for (const int along : {0, 1}) {
      const Cut result = cut(mesh, plan_of(style, along));
      Eigen::Vector3d from = result.moves.front().end;
      int back = 0;
      for (const PathMove& move : result.moves) {
        const Eigen::Vector3d way = move.end - from;
        if (move.kind != MoveKind::kCut || way[1 - along] != 0.0) {
          for (double part = 0.0; part <= 1.0; part += 0.01) {
            const Eigen::Vector3d tip = from + part * way;
            const CutterLocation under = cutter.drop(tip.head<2>());
            EXPECT_GT(tip.z() - (under.rests() ? under.tip : -1.0), 0.04);
          }
        }
        if (move.kind == MoveKind::kRapid && std::abs(way[along]) > kSide) {
          EXPECT_EQ(way[1 - along], 0.0);
          EXPECT_EQ(way.z(), 0.0);
          ++back;
        }
        from = move.end;
      }
      EXPECT_EQ(back, style == PassStyle::kZigzag ? 0 : result.summary.passes - 1);
    }
  }
}

TEST(FinishOperation, AddsUpWhatItHandsOut) {
  const Cut result = cut(relief(), plan_of(PassStyle::kConventional, 0));
  double rapid = 0.0;
  std::int64_t arcs = 0;
  Eigen::AlignedBox3d tip;
  Eigen::Vector3d from = result.moves.front().end;
  for (const PathMove& move : result.moves) {
    if (move.kind == MoveKind::kRapid) rapid += (move.end - from).norm();
    if (move.kind != MoveKind::kRapid) tip.extend(move.end);
    arcs += move.arc_axis >= 0 ? 1 : 0;
    from = move.end;
  }
  const OperationSummary& summary = result.summary;
  EXPECT_TRUE(summary.complete);
  EXPECT_TRUE(summary.certified);
  EXPECT_EQ(summary.moves, static_cast<std::int64_t>(result.moves.size()));
  EXPECT_EQ(summary.arcs, arcs);
  EXPECT_GT(arcs, 0);
  EXPECT_NEAR(summary.rapid_length, rapid, 1e-9);
  EXPECT_GT(summary.cutting_length, static_cast<double>(summary.passes) * kSide);
  EXPECT_EQ(summary.tip.min(), tip.min());
  EXPECT_EQ(summary.tip.max(), tip.max());
  EXPECT_EQ(summary.tool, 3);
  EXPECT_DOUBLE_EQ(summary.stepover, 0.1);
}

TEST(FinishOperation, WarnsWhereTheTolerancesAreNotHeld) {
  RasterPlan plan = plan_of(PassStyle::kZigzag, 0);
  plan.options.resolution = 0.001;
  const Cut result = cut(relief(), plan);
  ASSERT_GT(result.summary.certificate.slope.value, plan.options.slope_tolerance);
  ASSERT_FALSE(result.summary.remarks.empty());
  EXPECT_THAT(result.summary.remarks.back(), HasSubstr("direction is off by"));
}

TEST(FinishOperation, StoppedIsNotComplete) {
  std::stop_source source;
  const RunControl control(source.get_token(), [&](const Progress&) { source.request_stop(); });
  const FacetCutSurface surface(relief(), kRadius, Executor::serial());
  const OperationSummary summary = cut_finish(
      surface, plan_of(PassStyle::kZigzag, 0), finish_run(), Executor::serial(),
      [](std::span<const PathMove>) {}, control);
  EXPECT_FALSE(summary.complete);
  EXPECT_FALSE(summary.certified);
}

}  // namespace
}  // namespace lensforge::finish_operation_test
