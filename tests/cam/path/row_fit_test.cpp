// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/row_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "cam/adversarial_meshes.h"
#include "cam/contact/cut_surface.h"
#include "cam/row_certificate.h"

namespace lensforge::row_fit_test {
namespace {

using lensforge::testing::certify_row;

constexpr double kRadius = 0.2;

bool on_grid(double value, double resolution) {
  const double units = value / resolution;
  return std::abs(units - std::round(units)) < 1e-6;
}

RowProfile profile_of(const DropCutter& cutter, const RowFitOptions& options) {
  return RowCurves(cutter).profile({{0, 1.9}, 0.2, 3.8, 0.3, 3.7}, joint_bow(options));
}

RowFitOptions with_arcs(bool arcs) {
  RowFitOptions options;
  options.arcs = arcs;
  return options;
}

TEST(ArcFit, HoldsItsTolerancesOnEveryMesh) {
  for (const auto& [name, mesh] : testing::adversarial_meshes()) {
    if (name == "soup" || name == "steps" || name == "rough noise") continue;  // Walls.
    const DropCutter cutter(mesh, kRadius, Executor::serial());
    for (const bool arcs : {false, true}) {
      const RowFitOptions options = with_arcs(arcs);
      const RowProfile profile = profile_of(cutter, options);
      const FittedRow row = fit_row(profile, options);
      const PathCertificate certificate = certify_row(profile, row.start, row.moves);
      EXPECT_EQ(certificate.gouge.value, row.certificate.gouge.value);
      EXPECT_EQ(certificate.excess.value, row.certificate.excess.value);
      EXPECT_EQ(certificate.slope.value, row.certificate.slope.value);
      EXPECT_LE(certificate.gouge.value, options.tolerance) << name;
      EXPECT_LE(certificate.excess.value, options.tolerance) << name;
      EXPECT_LE(certificate.slope.value, options.slope_tolerance) << name;
    }
  }
}

/// Beside walls a joint is off by what the curve falls within one unit of the last decimal.
TEST(ArcFit, HoldsTheHeightTightlyBesideWalls) {
  for (const auto& [name, mesh] : testing::adversarial_meshes()) {
    const DropCutter cutter(mesh, kRadius, Executor::serial());
    const RowFitOptions options = with_arcs(true);
    const RowProfile profile = profile_of(cutter, options);
    const FittedRow row = fit_row(profile, options);
    const PathCertificate certificate = certify_row(profile, row.start, row.moves);
    EXPECT_LE(certificate.gouge.value, options.tolerance + 100.0 * options.grid.resolution) << name;
    EXPECT_LE(certificate.excess.value, options.tolerance + 100.0 * options.grid.resolution)
        << name;
  }
}

TEST(ArcFit, WritesNumbersOnTheProgramsGrid) {
  const SurfaceMesh mesh = testing::grid_mesh(28, 31, 4.0, 4.0, testing::lens_relief);
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  RowFitOptions options = with_arcs(true);
  options.grid.resolution = 1e-5;
  options.slope_tolerance = 8e-3;
  options.grid.z_zero = 6.1234567891;
  const FittedRow row = fit_row(profile_of(cutter, options), options);
  Eigen::Vector2d from = row.start;
  int arcs = 0;
  for (const RowMove& move : row.moves) {
    EXPECT_TRUE(on_grid(move.end.x(), options.grid.resolution));
    EXPECT_TRUE(on_grid(move.end.y() - options.grid.z_zero, options.grid.resolution));
    if (move.arc) {
      ++arcs;
      EXPECT_TRUE(on_grid(move.centre.x(), options.grid.resolution));
      EXPECT_TRUE(on_grid(move.centre.y() - options.grid.z_zero, options.grid.resolution));
      const double radius = (from - move.centre).norm();
      EXPECT_LE(radius, 1.01 * kLargestArc);
      // What Grbl allows is 0.005 mm.
      EXPECT_NEAR((move.end - move.centre).norm(), radius, 0.1 * options.grid.resolution);
    }
    EXPECT_GT(move.end.x(), from.x());
    from = move.end;
  }
  EXPECT_GT(arcs, 0);
}

/// What rounding does to a move is no more than what it does to its numbers.
TEST(ArcFit, MovesBeforeRoundingDifferByTheLastDecimal) {
  const SurfaceMesh mesh = testing::grid_mesh(28, 31, 4.0, 4.0, testing::lens_relief);
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  RowFitOptions options = with_arcs(true);
  options.grid.resolution = 1e-5;
  options.slope_tolerance = 8e-3;
  const FittedRow row = fit_row(profile_of(cutter, options), options);
  ASSERT_EQ(row.moves.size(), row.unrounded.moves.size());
  double most = 0.0;
  for (std::size_t i = 0; i < row.moves.size(); ++i) {
    const Eigen::Vector2d off = row.moves[i].end - row.unrounded.moves[i].end;
    most = std::max(most, off.cwiseAbs().maxCoeff());
  }
  EXPECT_LE(most, 0.75 * options.grid.resolution);
  EXPECT_GT(most, 0.1 * options.grid.resolution);
}

/// Rounding must not break moves up: a tenth of the tolerance takes about √10 (arcs of changing
/// curvature) to 10 times (lines) as many moves.
TEST(ArcFit, MovesGrowSlowlyAsDirectionsGetFiner) {
  const SurfaceMesh mesh = testing::grid_mesh(28, 31, 4.0, 4.0, [](double x, double y) {
    return 6.0 + 0.1 * std::sin(1.7 * x + 0.4) * std::cos(1.1 * y);
  });
  const SmoothCutSurface surface(mesh, kRadius, {1e-4, 2e-2}, Executor::serial());
  const RowSpan span{{0, 1.9}, -0.2, 4.2, -0.14, 4.14};
  const RowCurves curves(surface, {span.line.at(-0.2), span.line.at(4.2)}, Executor::serial());
  std::vector<std::size_t> moves;
  for (const double slope_tolerance : {1e-3, 3e-4, 1e-4}) {
    RowFitOptions options = with_arcs(true);
    options.slope_tolerance = slope_tolerance;
    RowProfile profile = curves.profile(span, joint_bow(options));
    level_ends(options.grid, profile);
    const FittedRow row = fit_row(profile, options);
    moves.push_back(row.moves.size());
    EXPECT_LE(row.certificate.slope.value, 1.01 * slope_tolerance);
  }
  EXPECT_LT(moves[1], 4 * moves[0]);
  EXPECT_LT(moves[2], 10 * moves[0]);
}

/// A cylinder of fine facets: the drop curve is a circle of radius 5 + R, and one arc an eighth
/// round says it all.
double shortest_of(const FittedRow& row) {
  double least = HUGE_VAL;
  Eigen::Vector2d from = row.start;
  for (const RowMove& move : row.moves) {
    least = std::min(least, move.end.x() - from.x());
    from = move.end;
  }
  return least;
}

/// A wave between level ends that turns so fast that only moves of 0.01 mm keep the slope's
/// tolerance.
RowProfile quick_wave() {
  RowProfile profile;
  const auto add = [&](double u, double z) {
    profile.u.push_back(u);
    profile.z.push_back(z);
  };
  constexpr double kHigh = 0.0013;
  add(-0.2, kHigh);
  for (int i = 0; i <= 8000; ++i) add(0.0005 * i, kHigh * std::cos(0.0025 * std::numbers::pi * i));
  add(4.2, kHigh);
  profile.joints = profile.u;
  return profile;
}

/// A controller that falls behind does more harm than a direction that is off for a moment.
TEST(ArcFit, MovesAreLongEnoughForTheControllerWhereDirectionsCannotBeKept) {
  RowFitOptions options = with_arcs(true);
  options.slope_tolerance = 6e-5;
  const FittedRow any = fit_row(quick_wave(), options);
  EXPECT_LE(any.certificate.slope.value, options.slope_tolerance);
  EXPECT_LT(shortest_of(any), 0.01);
  options.shortest = 0.04;
  const FittedRow row = fit_row(quick_wave(), options);
  EXPECT_GE(shortest_of(row), 0.0195);
  EXPECT_LT(row.moves.size(), any.moves.size());
  EXPECT_LE(row.certificate.gouge.value, options.tolerance);
  EXPECT_LE(row.certificate.slope.value, 16.0 * options.slope_tolerance);
}

TEST(ArcFit, FindsTheCircleOfACylinder) {
  const SurfaceMesh mesh = testing::grid_mesh(
      4001, 3, 4.0, 4.0, [](double x, double) { return std::sqrt(25.0 - (x - 2.0) * (x - 2.0)); });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RowFitOptions options = with_arcs(true);
  const RowProfile profile =
      RowCurves(cutter).profile({{0, 1.9}, 0.3, 3.7, 0.3, 3.7}, joint_bow(options));
  const FittedRow row = fit_row(profile, options);
  const FittedRow lines = fit_row(profile, with_arcs(false));
  EXPECT_LE(row.moves.size(), 3U);
  EXPECT_GT(lines.moves.size(), 50 * row.moves.size());
  EXPECT_NEAR((row.start - row.moves[0].centre).norm(), 5.0 + kRadius, 0.01);
  EXPECT_NEAR(row.moves[0].centre.x(), 2.0, 0.01);
}

/// A ridge of a right angle is a quarter of a circle of the ball's radius.
TEST(ArcFit, RollsOverARidgeInOneArc) {
  const SurfaceMesh mesh = testing::grid_mesh(
      41, 3, 4.0, 4.0, [](double x, double) { return 5.0 - 0.8 * std::abs(x - 2.0); });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RowFitOptions options = with_arcs(true);
  const FittedRow row = fit_row(profile_of(cutter, options), options);
  const auto arc = std::find_if(row.moves.begin(), row.moves.end(), [](const RowMove& move) {
    return move.arc && move.end.x() > 2.0 && move.end.x() < 2.2;
  });
  ASSERT_NE(arc, row.moves.end());
  EXPECT_TRUE(arc->cap);
  EXPECT_NEAR(arc->centre.x(), 2.0, 1e-3);
  EXPECT_NEAR((arc->end - arc->centre).norm(), kRadius, 1e-3);
}

TEST(ArcFit, FollowsAPlaneInOneMove) {
  const SurfaceMesh mesh =
      testing::grid_mesh(33, 33, 4.0, 4.0, [](double x, double y) { return 0.2 * x + 0.1 * y; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RowFitOptions options = with_arcs(true);
  const FittedRow row = fit_row(
      RowCurves(cutter).profile({{0, 1.9}, 0.3, 3.7, 0.3, 3.7}, joint_bow(options)), options);
  EXPECT_EQ(row.moves.size(), 1U);
}

}  // namespace
}  // namespace lensforge::row_fit_test
