// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/smooth_roll.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/contact/cut_surface.h"
#include "cam/contact/drop_cutter.h"
#include "cam/path/row_fit.h"
#include "cam/path/row_profile.h"
#include "core/lens/smooth_surface.h"

namespace lensforge::smooth_roll_test {
namespace {

constexpr double kRadius = 0.2;
constexpr double kSide = 3.0;

/// Waves and a crease that a ball rolls through; triangles of 0.14 mm.
SurfaceMesh relief() {
  return testing::grid_mesh(22, 23, kSide, kSide, [](double x, double y) {
    return 6.0 + 0.1 * std::sin(2.2 * x + 0.4) * std::cos(1.7 * y) +
           0.05 * std::cos(1.5 * x - 3.0 * y) + 0.02 * std::abs(x - 1.7 + 0.3 * y);
  });
}

SmoothCutSurface cut_surface(const SurfaceMesh& mesh, double deviation = 2e-6,
                             double radius = kRadius) {
  SmoothCutOptions options;
  options.deviation = deviation;
  options.slope_deviation = 1.0;
  return {mesh, radius, options, Executor::cpu(2)};
}

double at(const CurveNodes& nodes, double u) {
  const auto next = std::lower_bound(nodes.u.begin() + 1, nodes.u.end() - 1, u) - nodes.u.begin();
  const auto i = static_cast<std::size_t>(next);
  const double part = (u - nodes.u[i - 1]) / (nodes.u[i] - nodes.u[i - 1]);
  return nodes.z[i - 1] + part * (nodes.z[i] - nodes.z[i - 1]);
}

/// Where and how high the highest of a great many points of the surface around p holds the tip.
struct BruteContact {
  Eigen::Vector2d q{0.0, 0.0};
  double tip = kNoContact;
};

BruteContact brute_contact(const OpticalSurface& surface, const Eigen::Vector2d& p, double spacing,
                           double radius = kRadius) {
  BruteContact best;
  for (double dx = -radius; dx <= radius; dx += spacing) {
    for (double dy = -radius; dy <= radius; dy += spacing) {
      const Eigen::Vector2d q = nearest_inside(surface.box(), p + Eigen::Vector2d(dx, dy));
      if (std::hypot(dx, dy) > radius || (q - p).norm() > radius) continue;
      const double s = std::sqrt(radius * radius - (q - p).squaredNorm());
      const double tip = surface.at(q)->z + s - radius;
      if (tip > best.tip) best = {q, tip};
    }
  }
  return best;
}

double brute_tip(const OpticalSurface& surface, const Eigen::Vector2d& p, double spacing) {
  return brute_contact(surface, p, spacing).tip;
}

TEST(SmoothPatch, EqualsTheSurfaceAndItsDifferences) {
  const SmoothSurface surface(relief());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0.05, kSide - 0.05);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d q(place(random), place(random));
    const auto patch = surface.patch_at(q);
    ASSERT_TRUE(patch && patch->contains(q));
    const SurfaceShape shape = patch->at(q);
    const auto exact = surface.at(q);
    EXPECT_NEAR(shape.z, exact->z, 1e-13);
    EXPECT_LT((shape.slope - exact->slope).norm(), 1e-11);
    for (const auto& [k, step] : {std::pair{0, 1e-4}, {0, 5e-5}, {1, 1e-4}, {1, 5e-5}}) {
      const Eigen::Vector2d way = step * Eigen::Vector2d::Unit(k);
      const Eigen::Vector2d bend =
          (patch->at(q + way).slope - patch->at(q - way).slope) / (2.0 * step);
      EXPECT_LT((shape.bend.col(k) - bend).norm(), 1e-6);
    }
  }
}

TEST(SmoothPatch, BendStaysInTheRangeOfItsTriangle) {
  const SurfaceMesh mesh = relief();
  const SmoothSurface surface(mesh);
  double sharp = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const BendRange range = surface.bend_range(t);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d q = 0.5 * mesh.corner(t, k) + 0.25 * mesh.corner(t, (k + 1) % 3) +
                                0.25 * mesh.corner(t, (k + 2) % 3);
      const Eigen::Matrix2d bend = surface.patch_at(q.head<2>())->at(q.head<2>()).bend;
      const double mean = 0.5 * bend.trace();
      const double half = std::sqrt(std::max(mean * mean - bend.determinant(), 0.0));
      EXPECT_LE(mean + half, range.largest + 1e-9);
      EXPECT_GE(mean - half, range.least - 1e-9);
      sharp = std::max(sharp, (mean + half) / std::max(range.largest, 1e-3));
    }
  }
  EXPECT_GT(sharp, 0.5);
}

/// The bounds are those of the drop surface itself, at the rim, too.
TEST(SmoothRoll, EqualsBruteForceOverTheSmoothSurface) {
  const SmoothCutSurface surface = cut_surface(relief());
  for (const AxisLine& line : {AxisLine{0, 1.234}, AxisLine{1, 0.777}, AxisLine{0, -0.05}}) {
    SmoothRoll ball(*surface.bed(), line);
    for (const double from : {-0.1, 0.0, 0.4, 1.5, 2.98, 3.08}) {
      const auto nodes = ball.follow(from, from + 0.004, 1e-7);
      ASSERT_TRUE(nodes) << from;
      EXPECT_LE(nodes->error, 1.01e-7);
      const double u = from + 0.0013;
      const double brute = brute_tip(surface.surface(), line.at(u), 0.001);
      // Points 1 µm apart miss the highest by (0.7 µm)²/2 · (1/R + bend) at most.
      EXPECT_GE(at(*nodes, u), brute - nodes->error);
      EXPECT_LE(at(*nodes, u), brute + nodes->error + 2e-6);
    }
  }
}

/// The larger the ball, the more of the surface lies below it, and the less of that it can touch.
TEST(SmoothBed, FootprintHoldsEveryContact) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> beyond(-0.4, kSide + 0.4);
  for (const double radius : {0.2, 1.0, 2.5}) {
    const SmoothCutSurface surface = cut_surface(relief(), 1e-4, radius);
    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector2d p(beyond(random), beyond(random));
      const double out = (p - nearest_inside(surface.surface().box(), p)).norm();
      if (out > 0.5 * radius) continue;
      const BruteContact contact = brute_contact(surface.surface(), p, radius / 60.0, radius);
      const Eigen::AlignedBox2d foot = surface.bed()->footprint(Eigen::AlignedBox2d(p));
      EXPECT_LT(foot.exteriorDistance(contact.q), radius / 60.0) << radius << " at " << p;
      EXPECT_GE(surface.bed()->bounds().over(foot).highest, contact.tip);
    }
  }
}

/// A valley that a large ball cannot reach does not keep it from rolling a radius away.
TEST(SmoothRoll, LargeBallRollsBesideAValley) {
  constexpr double kLarge = 1.5;
  const SurfaceMesh mesh = testing::grid_mesh(61, 61, kSide, kSide, [](double x, double y) {
    return 6.0 + 0.05 * std::abs(x - 1.5) + 0.01 * std::sin(1.3 * y);
  });
  const SmoothCutSurface surface = cut_surface(mesh, 1e-5, kLarge);
  SmoothRoll ball(*surface.bed(), {0, 1.1});
  EXPECT_FALSE(ball.follow(1.49, 1.51, 1e-7));
  for (const double from : {0.6, 1.0, 1.95, 2.4}) {
    const auto nodes = ball.follow(from, from + 0.004, 1e-7);
    ASSERT_TRUE(nodes) << from;
    const double u = from + 0.0013;
    const double brute = brute_contact(surface.surface(), {u, 1.1}, 0.004, kLarge).tip;
    EXPECT_GE(at(*nodes, u), brute - nodes->error);
    EXPECT_LE(at(*nodes, u), brute + nodes->error + 1e-5);
  }
}

/// The facets of the same surface hold the ball as high, but for what they deviate.
TEST(SmoothRoll, RowsKeepTheirDistanceFromTheFacets) {
  const SmoothCutSurface surface = cut_surface(relief(), 1e-5);
  const auto cutter =
      surface.cutter({Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kSide, kSide)}, Executor::cpu(2));
  const double most = surface.deviation().height;
  ASSERT_LT(most, 1.1e-5);
  for (const AxisLine& line : {AxisLine{0, 1.234}, AxisLine{1, 1.71}, AxisLine{0, 3.1}}) {
    const RowSpan span{line, -0.2, kSide + 0.2, -0.09, kSide + 0.09};
    const Eigen::AlignedBox2d axis(line.at(span.held_from), line.at(span.held_to));
    const RowProfile profile = RowCurves(surface, axis, Executor::serial()).profile(span, 2.5e-6);
    EXPECT_LE(profile.error, kProfileError * 1.01);
    std::size_t hint = 0;
    CutterLocation near;
    for (double u = span.held_from; u <= span.held_to; u += 0.00137) {
      near = cutter->drop(line.at(u), near);
      ASSERT_NEAR(profile.at(u, hint), near.tip, most + profile.error) << u;
    }
  }
}

/// A sphere of radius 5 is rolled along on one of radius 5 + R, and as far up or down as the smooth
/// surface is.
TEST(SmoothRoll, RollsOnASphereAlongACircle) {
  const SurfaceMesh mesh = testing::grid_mesh(121, 121, kSide, kSide, [](double x, double y) {
    return std::sqrt(25.0 - (x - 1.5) * (x - 1.5) - (y - 1.5) * (y - 1.5));
  });
  const SmoothCutSurface surface = cut_surface(mesh, 1e-4);
  const AxisLine line{0, 1.3};
  SmoothRoll ball(*surface.bed(), line);
  const double shift = surface.surface().at({1.5, 1.5})->z - 5.0;
  for (double from = 0.5; from < 2.5; from += 0.025) {
    const auto nodes = ball.follow(from, from + 0.025, 1e-8);
    ASSERT_TRUE(nodes);
    for (std::size_t i = 0; i < nodes->u.size(); ++i) {
      const double x = nodes->u[i] - 1.5;
      const double exact = std::sqrt(5.2 * 5.2 - x * x - 0.2 * 0.2) - kRadius;
      EXPECT_NEAR(nodes->z[i], exact + shift, 5e-6);  // What the smooth surface is off the sphere.
    }
  }
}

/// In a groove that bends as sharply as the ball there may be two contacts: that is not rolled
/// through, and the row follows the facets there.
TEST(SmoothRoll, LeavesSharpGroovesToTheFacets) {
  const SurfaceMesh mesh = testing::grid_mesh(
      61, 3, kSide, kSide, [](double x, double) { return 1.0 + 0.6 * std::abs(x - 1.513); });
  const SmoothCutSurface surface = cut_surface(mesh);
  const AxisLine line{0, 1.5};
  SmoothRoll ball(*surface.bed(), line);
  EXPECT_FALSE(ball.follow(1.51, 1.515, kProfileError));
  EXPECT_TRUE(ball.follow(0.7, 0.705, kProfileError));
  const RowSpan span{line, 0.2, 2.8, 0.3, 2.7};
  const Eigen::AlignedBox2d axis(line.at(0.3), line.at(2.7));
  const RowProfile profile = RowCurves(surface, axis, Executor::serial()).profile(span, 2.5e-6);
  const auto cutter = surface.cutter(axis, Executor::serial());
  std::size_t hint = 0;
  for (double u = 0.3; u <= 2.7; u += 0.0013) {
    EXPECT_NEAR(profile.at(u, hint), cutter->drop(line.at(u)).tip,
                surface.deviation().height + kProfileError);
  }
}

/// On a slope the ball reaches the rim before or behind its axis. Over the rim its path bends as
/// sharply as the ball, which takes shorter moves than a controller may have time for.
TEST(SmoothRoll, RowsAreJudgedWithinTheRimAlone) {
  const RowFitOptions options{5e-4, 6e-5, {1e-6, 0.0}, true, 0.009};
  for (double slope = -0.4; slope <= 0.41; slope += 0.1) {
    const SurfaceMesh mesh = testing::grid_mesh(4, 4, kSide, kSide, [&](double x, double) {
      return 5.0 + slope * x - 0.1 * (x - kSide) * x;
    });
    Eigen::Matrix2Xd slopes = Eigen::Matrix2Xd::Zero(2, mesh.vertices.cols());
    slopes.row(0) = (slope + 0.1 * kSide) - 0.2 * mesh.vertices.row(0).array();
    const SmoothCutSurface surface(std::make_shared<const SmoothSurface>(mesh, slopes), kRadius, {},
                                   Executor::serial());
    const auto profile = [&](const AxisLine& line) {
      const RowSpan span{line, -0.3, kSide + 0.3, -0.14, kSide + 0.14};
      const Eigen::AlignedBox2d axis(line.at(span.held_from), line.at(span.held_to));
      return RowCurves(surface, axis, Executor::serial()).profile(span, joint_bow(options));
    };
    const RowProfile row = profile({0, 0.03});
    const auto ahead = [](double steep) { return kRadius * steep / std::hypot(1.0, steep); };
    const double first = -ahead(slope + 0.1 * kSide);
    const double last = kSide - ahead(slope - 0.1 * kSide);
    EXPECT_GE(row.shaped_from, first + 0.02);
    EXPECT_LE(row.shaped_from, first + 0.05);
    EXPECT_LE(row.shaped_to, last - 0.02);
    EXPECT_GE(row.shaped_to, last - 0.05);
    EXPECT_FALSE(profile({0, -0.1}).shapes(0.5 * kSide));  // All along it there is the rim.
    RowProfile level = row;
    level_ends(options.grid, level);
    EXPECT_LE(fit_row(level, options).certificate.slope.value, options.slope_tolerance) << slope;
  }
}

}  // namespace
}  // namespace lensforge::smooth_roll_test
