// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/outline_cut.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "cam/workshop/workshop.h"
#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/outline.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using testing::message_of;
using Points = std::vector<Eigen::Vector2d>;

const Eigen::Vector2d kSize(60.0, 50.0);
constexpr double kTop = 4.0;
constexpr double kMargin = 8.0;

Eigen::AlignedBox3d blank_with(double margin) {
  return {Eigen::Vector3d(-margin, -margin, 0.0),
          Eigen::Vector3d(kSize.x() + margin, kSize.y() + margin, kTop)};
}

OutlineCut usual_cut() {
  OutlineCut cut;
  cut.tool = Workshop().tool(3);
  cut.safe_z = 9.0;
  return cut;
}

/// A notch wider than the tool, and one narrower than it.
Points notched() {
  return {{0, 0},   {60, 0},  {60, 50}, {42, 50}, {42, 30}, {40, 30},
          {40, 50}, {25, 50}, {20, 20}, {15, 50}, {0, 50}};
}

std::vector<Points> shapes() {
  return {circle_outline(kSize).points, rounded_outline(kSize, 6.0).points,
          Points{{0, 0}, {60, 0}, kSize, {0, 50}}, notched()};
}

struct Cut {
  OperationSummary summary;
  std::vector<PathMove> moves;
};

Cut cut_out(const Points& outline, const OutlineCut& cut, StockMap& stock) {
  Cut result;
  const MoveSink sink = [&](std::span<const PathMove> moves) {
    result.moves.insert(result.moves.end(), moves.begin(), moves.end());
  };
  result.summary = cut_outline(outline, cut, stock, sink, {});
  return result;
}

Cut cut_out(const Points& outline, const OutlineCut& cut) {
  StockMap stock(blank_with(kMargin), 0.2);
  return cut_out(outline, cut, stock);
}

/// Side by side, without any index: how far a point is from a part, below 0 inside of it.
double away_from(const Points& part, const Eigen::Vector2d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  double turns = 0.0;
  for (std::size_t k = 0; k < part.size(); ++k) {
    const Eigen::Vector2d a = part[k] - p;
    const Eigen::Vector2d b = part[(k + 1) % part.size()] - p;
    const Eigen::Vector2d side = b - a;
    const double share = std::clamp(-a.dot(side) / side.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (a + share * side).norm());
    turns += std::atan2(cross(a, b), a.dot(b));
  }
  return std::fabs(turns) > std::numbers::pi ? -nearest : nearest;
}

/// Places of the tip along all moves at feed, this close to one another.
std::vector<Eigen::Vector3d> places(const Cut& cut, double apart) {
  std::vector<Eigen::Vector3d> places;
  Eigen::Vector3d at = cut.moves.front().end;
  for (const PathMove& move : cut.moves) {
    const int steps = std::max(1, static_cast<int>(std::ceil((move.end - at).norm() / apart)));
    for (int k = 1; k <= steps && move.kind != MoveKind::kRapid; ++k) {
      places.emplace_back(at + (move.end - at) * k / steps);
    }
    at = move.end;
  }
  return places;
}

TEST(OutlineOperation, NeverEntersThePart) {
  for (const Points& part : shapes()) {
    const Cut cut = cut_out(part, usual_cut());
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& tip : places(cut, 0.5)) {
      nearest = std::min(nearest, away_from(part, tip.head<2>()));
    }
    EXPECT_GE(nearest, 1.5);
    EXPECT_LE(nearest, 1.5 + kOutlineOversize);
  }
}

TEST(OutlineOperation, LeavesTheTabsAndNothingElse) {
  for (const Points& part : {circle_outline(kSize).points, rounded_outline(kSize, 6.0).points}) {
    const OutlineCut options = usual_cut();
    const Cut cut = cut_out(part, options);
    const std::vector<Eigen::Vector3d> tips = places(cut, 0.05);
    // What stays in the middle of the slot, point by point.
    const Points way = offset_outline(part, 1.5).points;
    constexpr double kApart = 0.1;
    std::vector<double> left;
    std::vector<double> spacing;
    for (std::size_t k = 0; k < way.size(); ++k) {
      const Eigen::Vector2d a = way[k];
      const Eigen::Vector2d b = way[(k + 1) % way.size()];
      const int steps = std::max(1, static_cast<int>((b - a).norm() / kApart));
      for (int i = 0; i < steps; ++i) {
        const Eigen::Vector2d p = a + (b - a) * i / steps;
        double height = kTop;
        for (const Eigen::Vector3d& tip : tips) {
          if ((tip.head<2>() - p).norm() < 1.5 - 1e-9) height = std::min(height, tip.z());
        }
        left.push_back(height);
        spacing.push_back((b - a).norm() / steps);
      }
    }
    int tabs = 0;
    double standing = 0.0;
    for (std::size_t k = 0; k < left.size(); ++k) {
      const double before = left[(k + left.size() - 1) % left.size()];
      if (left[k] > 1e-6 && before <= 1e-6) ++tabs;
      if (left[k] <= 1e-6) continue;
      standing += spacing[k];
      EXPECT_NEAR(left[k], options.tabs.height, 0.01);
    }
    EXPECT_EQ(tabs, options.tabs.count);
    EXPECT_NEAR(standing / tabs, options.tabs.width, 0.25);
  }
}

TEST(OutlineOperation, GoesThroughTheBlankAndNoDeeper) {
  for (const Points& part : shapes()) {
    const Cut cut = cut_out(part, usual_cut());
    EXPECT_EQ(cut.summary.tip.min().z(), 0.0);
    EXPECT_TRUE(cut.summary.complete);
    EXPECT_LE(cut.summary.stepdown, 1.0);
    EXPECT_EQ(cut.summary.passes, 4 + 2);
  }
}

TEST(OutlineOperation, GoesNoDeeperThanItsBottom) {
  OutlineCut options = usual_cut();
  options.bottom = 4e-7;
  const Cut cut = cut_out(circle_outline(kSize).points, options);
  EXPECT_NEAR(cut.summary.tip.min().z(), 4e-7, 1e-15);
}

/// Wherever tabs stand, at the way's first point too, where the tool turns round.
TEST(OutlineOperation, GetsDownNoSteeperThanItsRamp) {
  const double steepest = std::tan(3.0 * std::numbers::pi / 180.0);
  for (const Points& part : shapes()) {
    for (const int tabs : {1, 2, 3, 4}) {
      for (const double width : {1.0, 3.0, 8.0}) {
        OutlineCut options = usual_cut();
        options.tabs = {tabs, width, 0.6};
        const Cut cut = cut_out(part, options);
        Eigen::Vector3d at = cut.moves.front().end;
        for (const PathMove& move : cut.moves) {
          const Eigen::Vector3d way = move.end - at;
          if (move.kind == MoveKind::kCut && way.z() < -1e-6) {
            EXPECT_LE(-way.z(), way.head<2>().norm() * steepest * (1.0 + 1e-6) + 1e-6)
                << tabs << " tabs of " << width;
          }
          at = move.end;
        }
      }
    }
  }
}

TEST(OutlineOperation, WithoutTabsThePartIsFree) {
  OutlineCut options = usual_cut();
  options.tabs.count = 0;
  const Cut cut = cut_out(circle_outline(kSize).points, options);
  const auto& moves = cut.moves;
  EXPECT_EQ(moves[moves.size() - 2].end.z(), 0.0);
  EXPECT_EQ(cut.summary.tip.min().z(), 0.0);
}

TEST(OutlineOperation, TellsOfNotchesThatStay) {
  const OutlineWay way = offset_outline(notched(), 1.5);
  // 2 mm wide and 20 mm deep, less what a 3 mm tool rounds off at its mouth; the tip of the wedge.
  EXPECT_GT(way.left, 36.0);
  EXPECT_LT(way.left, 60.0);
  EXPECT_EQ(cut_out(notched(), usual_cut()).summary.warnings.size(), 1U);
  EXPECT_LT(offset_outline(circle_outline(kSize).points, 1.5).left, 0.05);
}

TEST(OutlineOperation, RefusesWhatCannotHold) {
  const Points part = circle_outline(kSize).points;
  const auto said = [&](const OutlineCut& cut, double margin) {
    return message_of<InputError>([&] { require_outline_cut(part, cut, blank_with(margin)); });
  };
  EXPECT_NO_THROW(require_outline_cut(part, usual_cut(), blank_with(kMargin)));
  OutlineCut cut = usual_cut();
  cut.tabs.count = 30;
  EXPECT_THAT(said(cut, kMargin), HasSubstr("--tabs 30: need 36.5 mm each"));
  EXPECT_EQ(with_tabs_that_fit(part, cut).tabs.count, 4);
  cut.tabs.count = 3;
  EXPECT_EQ(with_tabs_that_fit(part, cut).tabs.count, 3);
  cut = usual_cut();
  cut.tool = Workshop().tool(2);
  EXPECT_THAT(said(cut, kMargin), HasSubstr("must be a flat end mill"));
  const Points rectangle{{0, 0}, {60, 0}, kSize, {0, 50}};
  EXPECT_THAT(
      message_of<InputError>([&] { require_outline_cut(rectangle, usual_cut(), blank_with(3.0)); }),
      HasSubstr("--margin 6mm works"));
  EXPECT_NO_THROW(require_outline_cut(rectangle, usual_cut(), blank_with(6.0)));
}

}  // namespace
}  // namespace lensforge
