// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/milled_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/contact/drop_cutter.h"
#include "cam/milled_paths.h"
#include "cam/milled_tiles.h"
#include "cam/path/finish_raster.h"

namespace lensforge::milled_field_test {
namespace {

constexpr double kRadius = 0.2;
constexpr double kPitch = 0.06;
constexpr double kBlankTop = 10.0;

/// Rows along x from −1 to 2 at y = k·kPitch; the tip's height at (x, y) is tip(x, y), straight
/// between x = −1 and 2.
template <class Tip>
BallPath straight_rows(const Tip& tip) {
  BallPath path(kRadius, 0.0);
  std::vector<Eigen::Vector3d> tips;
  for (int k = -20; k <= 40; ++k) {
    const double y = k * kPitch;
    tips.emplace_back(-1.0, y, tip(-1.0, y));
    tips.emplace_back(2.0, y, tip(2.0, y));
    if (k % 2 != 0) std::swap(tips[tips.size() - 1], tips[tips.size() - 2]);
  }
  testing::add_polyline(path, tips);
  return path;
}

/// Distance from the nearest row.
double from_row(double y) { return std::remainder(y, kPitch); }

TEST(MilledField, PlaneKeepsScallopsOfTheClosedForm) {
  const MilledField field({straight_rows([](double, double) { return 1.0; })}, kBlankTop);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({0.0, 0.0}, 0.003, 61, 101));
  double highest = 0.0;
  double steepest = 0.0;
  for (std::int64_t n = 0; n < patch.window.size(); ++n) {
    const auto i = static_cast<std::size_t>(n);
    const double w = from_row(patch.window.y(n / patch.window.columns));
    const double r = std::sqrt(kRadius * kRadius - w * w);
    EXPECT_NEAR(patch.z[i], 1.0 + kRadius - r, 1e-13);
    EXPECT_NEAR(patch.slope_x[i], 0.0, 1e-13);
    EXPECT_NEAR(std::abs(patch.slope_y[i]), std::abs(w) / r, 1e-12);
    highest = std::max(highest, patch.z[i] - 1.0);
    steepest = std::max(steepest, std::abs(patch.slope_y[i]));
  }
  const double ridge = std::sqrt(kRadius * kRadius - 0.25 * kPitch * kPitch);
  EXPECT_NEAR(highest, kRadius - ridge, 1e-12);
  EXPECT_NEAR(highest, 0.00226, 1e-5);
  EXPECT_NEAR(steepest, 0.5 * kPitch / ridge, 1e-12);
}

TEST(MilledField, NodesOnEitherSideOfACuspBelongToDifferentCuts) {
  const MilledField field({straight_rows([](double, double) { return 1.0; })}, kBlankTop);
  const SurfacePatch patch = testing::sampled(field, testing::window_at({0.1, 0.001}, 0.01, 1, 60));
  for (std::size_t j = 1; j < 60; ++j) {
    const double y = patch.window.y(static_cast<std::int64_t>(j));
    const bool same_row = std::round(y / kPitch) == std::round((y - 0.01) / kPitch);
    EXPECT_EQ(patch.cut[j] == patch.cut[j - 1], same_row) << y;
    EXPECT_GT(patch.cut[j], 0);
  }
}

TEST(MilledField, PlaneThatRisesAlongTheRowsKeepsItsScallops) {
  const double m = 0.4;
  const double secant = std::sqrt(1.0 + m * m);
  const MilledField field(
      {straight_rows([&](double x, double) { return m * x + kRadius * (secant - 1.0); })},
      kBlankTop);
  const SurfacePatch patch = testing::sampled(field, testing::window_at({0.0, 0.0}, 0.007, 60, 60));
  for (std::int64_t n = 0; n < patch.window.size(); ++n) {
    const auto i = static_cast<std::size_t>(n);
    const double x = patch.window.x(n % patch.window.columns);
    const double w = from_row(patch.window.y(n / patch.window.columns));
    const double r = std::sqrt(kRadius * kRadius - w * w);
    EXPECT_NEAR(patch.z[i], m * x + (kRadius - r) * secant, 1e-13);
    EXPECT_NEAR(patch.slope_x[i], m, 1e-11);
    EXPECT_NEAR(std::abs(patch.slope_y[i]), secant * std::abs(w) / r, 1e-11);
  }
}

TEST(MilledField, PlaneThatRisesAcrossTheRowsKeepsWiderScallops) {
  const double m = 0.4;
  const double secant = std::sqrt(1.0 + m * m);
  const MilledField field(
      {straight_rows([&](double, double y) { return m * y + kRadius * (secant - 1.0); })},
      kBlankTop);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({0.0, 0.0}, 0.001, 3, 1000));
  double highest = 0.0;
  for (std::int64_t n = 0; n < patch.window.size(); ++n) {
    const double y = patch.window.y(n / patch.window.columns);
    const double above = (patch.z[static_cast<std::size_t>(n)] - m * y) / secant;
    EXPECT_GE(above, -1e-13);
    highest = std::max(highest, above);
  }
  // Rows are p·√(1 + m²) apart on the plane; nodes of 1 µm miss the top by its slope times half.
  const double half = 0.5 * kPitch * secant;
  EXPECT_NEAR(highest, kRadius - std::sqrt(kRadius * kRadius - half * half), 1e-4);
  EXPECT_LE(highest, kRadius - std::sqrt(kRadius * kRadius - half * half) + 1e-13);
}

TEST(MilledField, VGrooveAlongARowKeepsTheClosedFormsFillet) {
  // Two planes of slope ±m meet in y = 0.6, where a row runs: the ball is held by both.
  const double m = 0.3;
  const double secant = std::sqrt(1.0 + m * m);
  const MilledField field({straight_rows([&](double, double y) {
                            return m * std::abs(y - 0.6) + kRadius * (secant - 1.0);
                          })},
                          kBlankTop);
  const SurfacePatch patch = testing::sampled(field, testing::window_at({0.3, 0.5}, 0.001, 1, 201));
  const double touch = kRadius * m / secant;  // R sin(Δ/2): half of the fillet's width
  for (std::int64_t j = 0; j < 201; ++j) {
    const double y = patch.window.y(j) - 0.6;
    const auto i = static_cast<std::size_t>(j);
    const double rounded = std::abs(y) < touch
                               ? kRadius * secant - std::sqrt(kRadius * kRadius - y * y)
                               : m * std::abs(y);
    EXPECT_GE(patch.z[i], rounded - 1e-13);
    if (std::abs(y) < touch) {
      EXPECT_NEAR(patch.z[i], rounded, 1e-13);
      EXPECT_NEAR(patch.slope_y[i], y / std::sqrt(kRadius * kRadius - y * y), 1e-11);
    }
  }
  EXPECT_NEAR(patch.z[100], kRadius * (secant - 1.0), 1e-13);
}

TEST(MilledField, VGrooveAcrossTheRowsKeepsTheClosedFormsFillet) {
  const double m = 0.3;
  const double secant = std::sqrt(1.0 + m * m);
  BallPath path(kRadius, 0.0);
  const double lift = kRadius * (secant - 1.0);
  testing::add_polyline(path, {{-1, 0, m + lift}, {0, 0, lift}, {1, 0, m + lift}});
  const MilledField field({path}, kBlankTop);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({-0.3, 0.0}, 0.002, 301, 1));
  const double touch = kRadius * m / secant;
  for (std::int64_t c = 0; c < 301; ++c) {
    const double x = patch.window.x(c);
    const auto i = static_cast<std::size_t>(c);
    const bool fillet = std::abs(x) < touch;
    const double z =
        fillet ? kRadius * secant - std::sqrt(kRadius * kRadius - x * x) : m * std::abs(x);
    const double slope = fillet ? x / std::sqrt(kRadius * kRadius - x * x) : std::copysign(m, x);
    EXPECT_NEAR(patch.z[i], z, 1e-13);
    EXPECT_NEAR(patch.slope_x[i], slope, 1e-10);
    EXPECT_EQ(patch.cut[i], patch.cut[0]);
  }
}

/// Tips over a sphere of radius rho around (0, 0, 0), touched from above; G18 arcs along x.
BallPath rows_over_ball(double rho) {
  BallPath path(kRadius, 0.0);
  for (int k = -10; k <= 10; ++k) {
    const double y = k * kPitch;
    const double r = std::sqrt((rho + kRadius) * (rho + kRadius) - y * y);
    const double height = std::sqrt(r * r - 1.0);
    const Eigen::Vector3d start(-1.0, y, height - kRadius);
    const Eigen::Vector3d end(1.0, y, height - kRadius);
    const Eigen::Vector3d centre(0.0, y, -kRadius);
    path.add(testing::arc_motion(ArcPlane::kZX, false, start, end, centre - start));
  }
  return path;
}

TEST(MilledField, ArcsOverASphereTouchItWithItsNormal) {
  const double rho = 3.0;
  const MilledField field({rows_over_ball(rho)}, kBlankTop);
  for (int k = -8; k <= 8; ++k) {
    const double y = k * kPitch * rho / (rho + kRadius);
    const SurfacePatch patch = testing::sampled(field, testing::window_at({-0.5, y}, 0.05, 20, 1));
    for (std::int64_t c = 0; c < 20; ++c) {
      const double x = patch.window.x(c);
      const double z = std::sqrt(rho * rho - x * x - y * y);
      const auto i = static_cast<std::size_t>(c);
      EXPECT_NEAR(patch.z[i], z, 1e-13);
      EXPECT_NEAR(patch.slope_x[i], -x / z, 1e-11);
      EXPECT_NEAR(patch.slope_y[i], -y / z, 1e-11);
    }
  }
}

TEST(MilledField, ABowlOfArcsKeepsNothingBelowTheBowlAndTouchesIt) {
  const double rho = 3.0;  // Of the bowl around (0, 0, 3).
  BallPath path(kRadius, 0.0);
  const double r = rho - kRadius;
  const double height = rho - std::sqrt(r * r - 1.0) - kRadius;
  path.add(
      testing::arc_motion(ArcPlane::kZX, true, {-1, 0, height}, {1, 0, height},
                          Eigen::Vector3d(0, 0, rho - kRadius) - Eigen::Vector3d(-1, 0, height)));
  const MilledField field({path}, kBlankTop);
  const SurfacePatch patch = testing::sampled(field, testing::window_at({-0.9, 0.0}, 0.05, 37, 1));
  for (std::int64_t c = 0; c < 37; ++c) {
    const double x = patch.window.x(c);
    const auto i = static_cast<std::size_t>(c);
    EXPECT_NEAR(patch.z[i], rho - std::sqrt(rho * rho - x * x), 1e-13);
    EXPECT_NEAR(patch.slope_x[i], x / std::sqrt(rho * rho - x * x), 1e-11);
  }
}

/// Chords of the motion's arc, so short that they are off by less than 1e-8 mm.
BallPath chords_of(const GcodeMotion& motion) {
  BallPath path(kRadius, 0.0);
  const Arc& arc = *motion.arc;
  const int count = static_cast<int>(std::abs(arc.sweep) / std::sqrt(8e-8 / arc.radius)) + 1;
  std::vector<Eigen::Vector3d> tips;
  for (int k = 0; k <= count; ++k) tips.push_back(arc.at(k / double(count)));
  testing::add_polyline(path, tips);
  return path;
}

TEST(MilledField, ArcsOfAllPlanesAndBothWaysEqualTheirChords) {
  for (const bool clockwise : {false, true}) {
    for (const double radius : {0.05, 0.19, 0.2, 0.21, 0.7}) {
      const Eigen::Vector3d a = radius * Eigen::Vector3d(0.6, 0.8, 0.0);
      const Eigen::Vector3d b = radius * Eigen::Vector3d(-0.28, 0.96, 0.0);
      const std::vector<GcodeMotion> motions{
          testing::arc_motion(ArcPlane::kXY, clockwise, a, b, -a),
          testing::arc_motion(ArcPlane::kZX, clockwise, {a.y(), 0.0, a.x()}, {b.y(), 0.0, b.x()},
                              {-a.y(), 0.0, -a.x()}),
          testing::arc_motion(ArcPlane::kYZ, clockwise, {0.0, a.x(), a.y()}, {0.0, b.x(), b.y()},
                              {0.0, -a.x(), -a.y()})};
      for (const GcodeMotion& motion : motions) {
        BallPath arc(kRadius, 0.0);
        arc.add(motion);
        const GridWindow window = testing::window_at({-0.93, -0.91}, 0.0631, 30, 30);
        const SurfacePatch exact = testing::sampled(MilledField({arc}, kBlankTop), window);
        const SurfacePatch chords =
            testing::sampled(MilledField({chords_of(motion)}, kBlankTop), window);
        for (std::size_t i = 0; i < exact.z.size(); ++i) {
          EXPECT_LE(exact.z[i], chords.z[i] + 1e-7);
          // Where a node is barely inside of the ball heights are infinitely steep.
          const double slope2 =
              exact.slope_x[i] * exact.slope_x[i] + exact.slope_y[i] * exact.slope_y[i];
          if (slope2 < 100.0) {
            EXPECT_NEAR(exact.z[i], chords.z[i], 3e-7);
          }
        }
      }
    }
  }
}

TEST(MilledField, BlankShowsWhereNothingWasCut) {
  BallPath path(kRadius, 0.0);
  testing::add_polyline(path, {{-1, 0, 5.0}, {0, 0, 5.0}, {0, 0, 0.9}, {0, 0, 5.0}, {3, 0, 5.0}});
  const MilledField field({path}, 1.0);
  const SurfacePatch patch = testing::sampled(field, testing::window_at({-0.5, 0.0}, 0.05, 21, 1));
  const double mouth = std::sqrt(kRadius * kRadius - 0.1 * 0.1);
  for (std::int64_t c = 0; c < 21; ++c) {
    const double x = std::abs(patch.window.x(c));
    const auto i = static_cast<std::size_t>(c);
    const bool cut = x < mouth;
    EXPECT_EQ(patch.cut[i] > 0, cut);
    EXPECT_NEAR(patch.z[i], cut ? 1.1 - std::sqrt(kRadius * kRadius - x * x) : 1.0, 1e-13);
    if (!cut) {
      EXPECT_EQ(patch.slope_x[i], 0.0);
    }
  }
}

TEST(MilledField, TheDeepestOfSeveralPathsShows) {
  BallPath coarse(1.0, 0.0);
  testing::add_polyline(coarse, {{-1, 0, 0.1}, {1, 0, 0.1}});
  BallPath fine(kRadius, 0.0);
  testing::add_polyline(fine, {{0, -1, 0.0}, {0, 1, 0.0}});
  const SurfacePatch patch = testing::sampled(MilledField({coarse, fine}, kBlankTop),
                                              testing::window_at({-0.5, 0.0}, 0.25, 5, 1));
  EXPECT_NEAR(patch.z[0], 0.1, 1e-15);
  EXPECT_NEAR(patch.z[2], 0.0, 1e-15);
  EXPECT_NE(patch.cut[0], patch.cut[2]);
  EXPECT_EQ(patch.cut[0], patch.cut[4]);
}

/// Creases of a random net of planes: the largest of some, which meet in valleys, and less some,
/// which meet on ridges.
SurfaceMesh creased_mesh(unsigned seed, double side) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> slope(-0.35, 0.35);
  std::uniform_real_distribution<double> height(0.0, 0.15);
  std::vector<Eigen::Vector3d> planes;
  planes.reserve(10);
  for (int k = 0; k < 10; ++k) planes.emplace_back(slope(random), slope(random), height(random));
  const auto at = [&](std::size_t k, double x, double y) {
    return planes[k].x() * (x - 0.5 * side) + planes[k].y() * (y - 0.5 * side) + planes[k].z();
  };
  return testing::grid_mesh(17, 19, side, side, [&](double x, double y) {
    double high = at(0, x, y);
    double low = at(5, x, y);
    for (std::size_t k = 1; k < 5; ++k) high = std::max(high, at(k, x, y));
    for (std::size_t k = 6; k < 10; ++k) low = std::max(low, at(k, x, y));
    return 2.0 + high - 0.7 * low;
  });
}

/// A finishing raster over a square from (0, 0) as it is cut, with straight links.
BallPath finishing_path(const SurfaceMesh& mesh, double side, const RasterOptions& options) {
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(
      {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(side, side)}, cutter.radius(), options);
  BallPath path(cutter.radius(), 0.0);
  GcodeMotion motion;
  for (std::int64_t row = 0; row < plan.rows; ++row) {
    const RasterRow cut = cut_row(RowCurves(cutter), plan, row);
    const Eigen::Vector3d start = cut.start;
    if (row > 0) testing::add_polyline(path, {motion.end, start});
    motion.end = start;
    for (const PathMove& move : cut.moves) {
      motion.start = motion.end;
      motion.end = move.end;
      motion.arc.reset();
      if (move.arc_axis >= 0) {
        const ArcPlane plane = move.arc_axis == 0   ? ArcPlane::kYZ
                               : move.arc_axis == 1 ? ArcPlane::kZX
                                                    : ArcPlane::kXY;
        motion.arc = testing::arc_motion(plane, move.clockwise, motion.start, move.end,
                                         move.centre - motion.start)
                         .arc;
      }
      path.add(motion);
    }
  }
  return path;
}

/// z(q) of one straight move by trisection, z being convex along it.
struct Slow {
  double z;
  Eigen::Vector3d centre;
};

Slow lowest_on(const BallMove& move, const Eigen::Vector2d& q) {
  const auto height = [&](double s) {
    const Eigen::Vector3d c = move.start + s * (move.end - move.start);
    const double room = kRadius * kRadius - (q - c.head<2>()).squaredNorm();
    // Outside of the ball: above all it could cut, and the higher the farther, so that the search
    // is led back.
    return room >= 0.0 ? c.z() - std::sqrt(room) : 1e3 - room;
  };
  double low = 0.0;
  double high = 1.0;
  for (int k = 0; k < 100; ++k) {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    if (height(a) <= height(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  const double s = height(0.0) <= height(low) ? 0.0 : height(1.0) <= height(low) ? 1.0 : low;
  return {height(s), move.start + s * (move.end - move.start)};
}

double angle_between(const Eigen::Vector2d& slope, const Eigen::Vector3d& normal) {
  return Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized().cross(normal).norm();
}

/// Compares the field with all moves of the path at every `step`th node of a millimetre of nodes
/// 1 µm apart: heights to 10 nm, normals to 1e-4 rad with one of the moves that are that deep.
void expect_equals_brute_force(unsigned seed, std::int64_t step) {
  const double side = 1.6;
  const SurfaceMesh mesh = creased_mesh(seed, side);
  const BallPath path = finishing_path(mesh, side, {});
  const MilledField field({path}, kBlankTop);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({0.31, 0.27}, 0.001, 1000, 1000));
  double worst = 0.0;
  double worst_angle = 0.0;
  for (std::int64_t n = 0; n < patch.window.size(); n += step) {
    const Eigen::Vector2d q = patch.window.node(n % 1000, n / 1000);
    const auto i = static_cast<std::size_t>(n);
    double least = kBlankTop;
    double angle = 4.0;
    for (const BallMove& move : path.moves()) {
      if (std::min(move.start.x(), move.end.x()) > q.x() + kRadius) continue;
      if (std::max(move.start.x(), move.end.x()) < q.x() - kRadius) continue;
      if (std::abs(move.start.y() - q.y()) > 2.0 * kRadius) continue;
      const Slow slow = lowest_on(move, q);
      least = std::min(least, slow.z);
      if (slow.z > patch.z[i] + 1e-9) continue;
      const Eigen::Vector3d n_slow =
          (slow.centre - Eigen::Vector3d(q.x(), q.y(), slow.z)) / kRadius;
      angle = std::min(angle, angle_between({patch.slope_x[i], patch.slope_y[i]}, n_slow));
    }
    worst = std::max(worst, std::abs(least - patch.z[i]));
    worst_angle = std::max(worst_angle, angle);
  }
  EXPECT_LE(worst, 1e-9);
  EXPECT_LE(worst_angle, 1e-6);
  ::testing::Test::RecordProperty("nanometres", std::to_string(worst * 1e6));
}

TEST(MilledField, EqualsBruteForceOnFinishingRowsOverCreases) {
  for (const unsigned seed : {1U, 2U, 3U}) expect_equals_brute_force(seed, 2999);
}

TEST(MilledField, RowsOfArcsLeaveWhatRowsOfChordsLeaveWithinTheTolerances) {
  const double side = 1.6;
  const SurfaceMesh mesh = creased_mesh(5, side);
  RasterOptions options;
  const BallPath chords = finishing_path(mesh, side, options);
  options.arcs = true;
  const BallPath arcs = finishing_path(mesh, side, options);
  EXPECT_GT(arcs.arcs().size(), 10U);
  const GridWindow window = testing::window_at({0.2, 0.2}, 0.0093, 120, 120);
  const SurfacePatch a = testing::sampled(MilledField({chords}, kBlankTop), window);
  const SurfacePatch b = testing::sampled(MilledField({arcs}, kBlankTop), window);
  double worst = 0.0;
  for (std::size_t i = 0; i < a.z.size(); ++i) worst = std::max(worst, std::abs(a.z[i] - b.z[i]));
  EXPECT_LE(worst, 2.2 * options.tolerance);
  EXPECT_GT(worst, 0.0);
}

TEST(MilledField, SameBitsForAnyTilesAndThreads) {
  const double side = 1.6;
  const MilledField field({finishing_path(creased_mesh(7, side), side, {})}, kBlankTop);
  testing::expect_same_bits_in_tiles(field, testing::window_at({0.1, 0.1}, 0.0037, 150, 140));
}

}  // namespace
}  // namespace lensforge::milled_field_test
