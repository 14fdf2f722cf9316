// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/polished_field.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled_paths.h"
#include "cam/path/finish_raster.h"
#include "cam/plan/finishing.h"
#include "cam/predict/part_surfaces.h"
#include "core/error.h"
#include "core/lens/surface_check.h"
#include "core/lens/surface_field.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kWidth = 12.0;
constexpr double kHeight = 4.2;
constexpr double kTop = 10.0;

/// A wave with slopes up to 0.08 and a valley, sharp on triangles of 0.2 mm, that runs across.
double relief(double x, double y) {
  return 6.0 + 0.1 * std::sin(0.8 * x + 0.4) * std::cos(0.3 * y) +
         0.05 * std::abs(x - 6.0 + 0.4 * (y - 2.1));
}

std::shared_ptr<const OpticalSurface> valley_surface(SurfaceModel model = SurfaceModel::kSmooth) {
  return optical_surface(testing::grid_mesh(61, 22, kWidth, kHeight, relief), model);
}

/// Tolerances so fine that what is left is what the balls leave.
CamOptions options_with(int large_tool, int every = 1) {
  CamOptions options;
  FinishProcess& finish = options.workshop.process.finish;
  finish.tolerance = 2e-5;
  finish.slope_tolerance = 2e-5;
  finish.large_tool = large_tool;
  finish.large_every = every;
  options.decimals = 6;
  return options;
}

FinishGround ground() {
  return {{Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kWidth, kHeight)}, 0.3, 0.0};
}

/// The surface with what finishes it.
struct Shop {
  std::shared_ptr<const OpticalSurface> surface = valley_surface();
  CamOptions options;
  FinishBalls balls;

  explicit Shop(int large_tool, int every = 1)
      : options(options_with(large_tool, every)),
        balls(surface, options, ground(), Executor::cpu(2)) {}

  [[nodiscard]] std::vector<PathMove> moves_of(const FinishPass& pass) const {
    std::vector<PathMove> moves;
    const MoveSink sink = [&](std::span<const PathMove> some) {
      moves.insert(moves.end(), some.begin(), some.end());
    };
    const FinishRun run{pass.name, pass.tool, kTop, 0.5, {}};
    EXPECT_TRUE(cut_finish(*pass.surface, pass.plan, run, Executor::cpu(2), sink, {}).complete);
    return moves;
  }

  [[nodiscard]] std::vector<BallPath> paths() const {
    std::vector<BallPath> paths;
    for (const FinishPass& pass : balls.passes(options, ground())) {
      const std::vector<PathMove> moves = moves_of(pass);
      path_sink(paths.emplace_back(pass.tool.radius(), 0.0))(moves);
    }
    return paths;
  }
};

/// The highest that points of the surface `spacing` apart hold the tip over p.
double brute_tip(const OpticalSurface& surface, const Eigen::Vector2d& p, double radius,
                 double spacing) {
  const Eigen::Array2d low = ((p.array() - radius).max(0.0) / spacing).floor();
  const Eigen::Array2d high =
      ((p.array() + radius).min(Eigen::Array2d(kWidth, kHeight)) / spacing).ceil();
  double tip = -HUGE_VAL;
  for (double i = low.x(); i <= high.x(); i += 1.0) {
    for (double j = low.y(); j <= high.y(); j += 1.0) {
      const Eigen::Vector2d q = nearest_inside(surface.box(), spacing * Eigen::Vector2d(i, j));
      const double d2 = (q - p).squaredNorm();
      if (d2 > radius * radius) continue;
      tip = std::max(tip, surface.at(q)->z + std::sqrt(radius * radius - d2) - radius);
    }
  }
  return tip;
}

TEST(BallBlend, MeanHeightIsTheSameAtEveryDistance) {
  for (const auto& [every, pitch] : {std::pair{1, 0.06}, {2, 0.045}, {3, 0.03}}) {
    const BallBlend blend({0.2, 3.0, pitch, every});
    const double mean = pitch * pitch / (24.0 * 0.2);
    for (double distance = 0.0; distance <= BallBlend::kWidth; distance += 0.01) {
      double sum = 0.0;
      constexpr int kPlaces = 6000;
      for (int i = 0; i < kPlaces; ++i) {
        const double x = every * pitch * (i + 0.5) / kPlaces;
        const auto circle = [](double radius, double apart, double place) {
          const double d = std::remainder(place, apart);
          return radius - std::sqrt(radius * radius - d * d);
        };
        sum += std::min(circle(0.2, pitch, x) + blend.small_lift(distance),
                        circle(3.0, every * pitch, x) + blend.large_lift(distance));
      }
      EXPECT_NEAR(sum / kPlaces, mean, 0.01 * mean) << distance;
    }
  }
}

TEST(BallBlend, EitherBallIsAboveTheOthersCrestsAtItsEnd) {
  const BallBlend blend({0.2, 3.0, 0.06, 1});
  const double small_crest = 0.06 * 0.06 / (8.0 * 0.2);
  const double large_crest = 0.06 * 0.06 / (8.0 * 3.0);
  EXPECT_EQ(blend.small_lift(0.0), 0.0);
  EXPECT_GE(blend.large_lift(0.0), small_crest);
  EXPECT_GE(blend.small_lift(BallBlend::kWidth) + 1e-8,
            blend.large_lift(BallBlend::kWidth) + large_crest);
  EXPECT_GT(blend.small_lift(BallBlend::kWidth + BallBlend::kRunOut), 0.5 * kLevelEnd);
}

/// Wherever the map does not say that something is left, the larger ball rolls, and touches what it
/// is to touch.
TEST(RestMap, LargeBallRollsOverEverythingElse) {
  const Shop shop(4);
  const RestMap& rest = *shop.balls.rest();
  const FinishPass large = shop.balls.passes(shop.options, ground()).front();
  const SmoothBed& bed = *large.surface->bed();
  const double share = rest.share_within(0.0);
  EXPECT_GT(share, 0.03);
  EXPECT_LT(share, 0.5);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d q(kWidth * part(random), kHeight * part(random));
    if (rest.distance(q) <= RestMap::kCell) continue;
    const Eigen::Vector2d slope = shop.surface->at(q)->slope;
    const Eigen::Vector2d p = q - 3.0 / std::sqrt(1.0 + slope.squaredNorm()) * slope;
    SmoothRoll roll(bed, {0, p.y()});
    const auto nodes = roll.follow(p.x() - 0.005, p.x() + 0.005, 1e-7);
    ASSERT_TRUE(nodes) << q.transpose();
    if (!bed.surface().box().contains(p)) continue;
    EXPECT_LT((nodes->contact.front() - q).norm(), 0.02) << q.transpose();
  }
}

/// Tips of both balls, over rows, gaps, links and hops, against the highest of many points.
TEST(FinishBalls, NoMoveGouges) {
  for (const int every : {1, 2}) {
    const Shop shop(4, every);
    for (const FinishPass& pass : shop.balls.passes(shop.options, ground())) {
      const std::vector<PathMove> moves = shop.moves_of(pass);
      const double radius = pass.tool.radius();
      const auto brute = [&](const Eigen::Vector3d& tip) {
        return brute_tip(*shop.surface, tip.head<2>(), radius, radius > 1.0 ? 0.05 : 0.01);
      };
      std::mt19937 random(9);
      std::uniform_int_distribution<std::size_t> any(1, moves.size() - 1);
      for (int i = 0; i < 60; ++i) {
        const std::size_t m = any(random);
        const Eigen::Vector3d tip = moves[m].end;
        EXPECT_GE(tip.z(), brute(tip) - 2e-6) << pass.name << " " << tip.transpose();
        if (moves[m].arc_axis >= 0) continue;
        const Eigen::Vector3d middle = 0.5 * (tip + moves[m - 1].end);
        EXPECT_GE(middle.z(), brute(middle) - 2.5e-5) << pass.name << " " << middle.transpose();
      }
    }
  }
}

/// What is left of either way of finishing, against what the smaller ball could reach with its rows
/// infinitely close: heights before polishing, and slopes after it, averaged over a pitch so that
/// what scallops leave does not count.
struct Finish {
  double lowest = HUGE_VAL, highest = -HUGE_VAL;  ///< mm
  double mean = 0.0;                              ///< mm
  double steepest = 0.0;                          ///< rad
};

Finish finish_of(const Shop& shop) {
  const MilledField milled(shop.paths(), kTop);
  const auto meant = meant_surface(shop.surface);
  const Executor executor = Executor::cpu(2);
  const auto rounded = meant->rounded(shop.balls.surface(), ground().rectangle, executor);
  const PolishModel polish{0.03, 0.0, 1.0};
  const PolishedField part(milled, ground().rectangle, polish);
  const PolishedField ideal(*rounded, ground().rectangle, polish);
  constexpr std::int64_t kRows = 6;  // A pitch.
  GridWindow window = lens_grid({kWidth, kHeight}, 0.01);
  window.first_column = 390;
  window.first_row = 180;
  window.columns = 330;
  window.rows = 60 + kRows;
  SurfacePatch raw, reached, polished, wanted;
  milled.sample(window, executor, raw);
  rounded->sample(window, executor, reached);
  part.sample(window, executor, polished);
  ideal.sample(window, executor, wanted);
  Finish finish;
  for (std::size_t n = 0; n < raw.z.size(); ++n) {
    finish.lowest = std::min(finish.lowest, raw.z[n] - reached.z[n]);
    finish.highest = std::max(finish.highest, raw.z[n] - reached.z[n]);
    finish.mean += (polished.z[n] - wanted.z[n]) / static_cast<double>(raw.z.size());
  }
  for (std::int64_t n = 0; n < window.size() - kRows * window.columns; ++n) {
    Eigen::Vector2d slope(0.0, 0.0);
    for (std::int64_t k = 0; k < kRows; ++k) {
      const auto at = static_cast<std::size_t>(n + k * window.columns);
      slope += Eigen::Vector2d(polished.slope_x[at] - wanted.slope_x[at],
                               polished.slope_y[at] - wanted.slope_y[at]) /
               static_cast<double>(kRows);
    }
    finish.steepest = std::max(finish.steepest, slope.norm());
  }
  return finish;
}

TEST(FinishBalls, NoStepIsLeftWhereOneBallTakesOver) {
  const Shop shop(4);
  ASSERT_GT(shop.balls.rest()->distance({3.9, 2.1}), BallBlend::kWidth);
  ASSERT_EQ(shop.balls.rest()->distance({6.0, 2.1}), 0.0);
  const Finish two = finish_of(shop);
  const Finish one = finish_of(Shop(0));
  const double crest = 0.06 * 0.06 / (8.0 * 0.2);
  EXPECT_GT(two.lowest, -2.5e-5);
  EXPECT_LT(two.highest, 1.05 * crest);
  EXPECT_LT(two.steepest, 1e-3);
  EXPECT_LT(one.steepest, 5e-4);
  EXPECT_NEAR(two.mean, one.mean, 0.02 * crest);
  EXPECT_NEAR(two.mean, crest / 3.0, 0.05 * crest);
}

TEST(FinishBalls, RowsOfTheLargerBallLieOnThoseOfTheSmaller) {
  for (const int every : {1, 2, 3}) {
    const Shop shop(4, every);
    const std::vector<FinishPass> passes = shop.balls.passes(shop.options, ground());
    ASSERT_EQ(passes.size(), 2U);
    const RasterPlan& large = passes.front().plan;
    const RasterPlan& small = passes.back().plan;
    EXPECT_NEAR(large.pitch, every * small.pitch, 1e-12);
    for (std::int64_t row = 0; row < large.rows; ++row) {
      const std::int64_t same = (row - large.rows_outside) * every + small.rows_outside;
      if (same < 0 || same >= small.rows) continue;
      EXPECT_NEAR(large.row_place(row), small.row_place(same), 1.1e-6);
    }
  }
}

TEST(FinishBalls, NothingIsLeftOfAGentleSurface) {
  const auto surface = optical_surface(
      testing::grid_mesh(61, 22, kWidth, kHeight,
                         [](double x, double) { return 6.0 + 0.05 * std::sin(0.5 * x); }),
      SurfaceModel::kSmooth);
  const CamOptions options = options_with(4);
  const FinishBalls balls(surface, options, ground(), Executor::serial());
  const std::vector<FinishPass> passes = balls.passes(options, ground());
  ASSERT_EQ(passes.size(), 1U);
  EXPECT_EQ(passes.front().name, "large");
  EXPECT_EQ(passes.front().tool.number, 4);
}

TEST(FinishBalls, ABallAsLargeAsTheLensIsRefused) {
  const Lens lens = testing::small_lens();
  EXPECT_THAT(message_of<InputError>([&] { validate(options_with(4), lens.setup); }),
              AllOf(HasSubstr("finish.large_tool 4: its diameter, 6 mm"), HasSubstr("2 mm")));
}

TEST(FinishBalls, FacetsAreRefusedForALargerBall) {
  const auto facets = valley_surface(SurfaceModel::kFacet);
  EXPECT_THAT(message_of<InputError>(
                  [&] { FinishBalls(facets, options_with(4), ground(), Executor::serial()); }),
              AllOf(HasSubstr("finish.large_tool 4"), HasSubstr("--surface smooth")));
}

}  // namespace
}  // namespace lensforge
