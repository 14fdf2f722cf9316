// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/finish_raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <vector>

#include "cam/cam_meshes.h"
#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;
constexpr double kSide = 4.0;

Eigen::AlignedBox2d square(double side) {
  return {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(side, side)};
}

/// Four millimetres of relief with creases, on triangles of 0.15 mm.
SurfaceMesh small_relief() {
  return testing::grid_mesh(28, 31, kSide, kSide, [](double x, double y) {
    return testing::lens_relief(3.0 * x, 3.0 * y) + 0.2 * std::abs(x - 1.234 + 0.3 * y);
  });
}

std::vector<RasterRow> all_rows(const DropCutter& cutter, const RasterPlan& plan,
                                const Executor& executor) {
  std::vector<RasterRow> rows;
  cut_raster(cutter, plan, executor, [&](const RasterRow& row) { rows.push_back(row); }, {});
  return rows;
}

TEST(FinishRaster, RowsLieOnBothBordersAndNoFartherApartThanThePitch) {
  const RasterPlan plan = plan_finish_raster(square(100.0), kRadius, {});
  EXPECT_EQ(plan.rows - 2 * plan.rows_outside, 1668);
  EXPECT_EQ(plan.row_y(plan.rows_outside), 0.0);
  EXPECT_EQ(plan.row_y(plan.rows - 1 - plan.rows_outside), 100.0);
  EXPECT_LE(plan.row_y(0), -plan.reach());
  EXPECT_GE(plan.row_y(plan.rows - 1), 100.0 + plan.reach());
  for (std::int64_t row = 1; row < plan.rows; ++row) {
    EXPECT_LE(plan.row_y(row) - plan.row_y(row - 1), 0.06 + 1e-4);
  }
}

TEST(FinishRaster, AWholeNumberOfPitchesCostsNoRowMore) {
  const RasterPlan plan = plan_finish_raster(square(3.0), kRadius, {});
  EXPECT_EQ(plan.rows - 2 * plan.rows_outside, 51);
  EXPECT_DOUBLE_EQ(plan.pitch, 0.06);
}

TEST(FinishRaster, ZigZagsAndTurnsAroundOutsideTheRim) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  const auto rows = all_rows(cutter, plan, Executor::serial());
  ASSERT_EQ(static_cast<std::int64_t>(rows.size()), plan.rows);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto& points = rows[r].points;
    const bool forward = r % 2 == 0;
    EXPECT_DOUBLE_EQ((forward ? points.front() : points.back()).x(), -kRadius);
    EXPECT_DOUBLE_EQ((forward ? points.back() : points.front()).x(), kSide + kRadius);
    for (std::size_t i = 1; i < points.size(); ++i) {
      EXPECT_EQ(points[i].x() > points[i - 1].x(), forward);
      EXPECT_EQ(points[i].y(), plan.row_y(static_cast<std::int64_t>(r)));
    }
  }
}

/// Largest and smallest of path − drop curve over a row, at places `step` apart.
std::pair<double, double> deviation(const DropCutter& cutter, const RasterRow& row, double step,
                                    double x_min, double x_max) {
  double deepest = 0.0;
  double highest = 0.0;
  CutterLocation near;
  for (std::size_t i = 1; i < row.points.size(); ++i) {
    Eigen::Vector3d a = row.points[i - 1];
    Eigen::Vector3d b = row.points[i];
    if (a.x() > b.x()) std::swap(a, b);
    for (double x = std::max(a.x(), x_min); x < std::min(b.x(), x_max); x += step) {
      const double path = a.z() + (b.z() - a.z()) * (x - a.x()) / (b.x() - a.x());
      near = cutter.drop({x, a.y()}, near);
      deepest = std::max(deepest, near.tip - path);
      highest = std::max(highest, path - near.tip);
    }
  }
  return {deepest, highest};
}

TEST(FinishRaster, NeverGougesDeeperThanTheTolerance) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  for (const double tolerance : {0.0005, 0.002, 0.00005}) {
    RasterOptions options;
    options.tolerance = tolerance;
    options.slope_tolerance = 1.0;
    options.resolution = 1e-5;
    const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, options);
    for (std::int64_t r = 0; r < plan.rows; r += 7) {
      const double y = plan.row_y(r);
      if (y < -plan.reach() || y > kSide + plan.reach()) continue;
      const double beyond = std::max({0.0, -y, y - kSide});
      const double reach = std::sqrt(plan.reach() * plan.reach() - beyond * beyond);
      const auto [deepest, highest] =
          deviation(cutter, cut_row(cutter, plan, r), 0.0007, -reach, kSide + reach);
      // z is rounded when it is written: half a unit less is left.
      EXPECT_LE(deepest, tolerance - 0.5 * options.resolution);
      EXPECT_LE(highest, tolerance - 0.5 * options.resolution);
    }
  }
}

TEST(FinishRaster, LinksBetweenRowsDoNotTouchThePart) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  const auto rows = all_rows(cutter, plan, Executor::serial());
  for (std::size_t r = 1; r < rows.size(); ++r) {
    const Eigen::Vector3d& from = rows[r - 1].points.back();
    const Eigen::Vector3d link = rows[r].points.front() - from;
    EXPECT_EQ(link.x(), 0.0);
    for (double part = 0.0; part <= 1.0; part += 0.02) {
      const Eigen::Vector3d tip = from + part * link;
      const double clearance = tip.z() - cutter.drop(tip.head<2>()).tip;
      EXPECT_GT(clearance, 0.5 * kRadius);
    }
  }
}

TEST(FinishRaster, KeepsTheDirectionOfTheDropCurve) {
  const SurfaceMesh mesh = testing::grid_mesh(21, 21, kSide, kSide, [](double x, double y) {
    return 0.1 * std::sin(1.5 * x) * std::cos(1.3 * y);
  });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  RasterOptions options;
  options.tolerance = 0.004;
  for (const double slope_tolerance : {1e-4, 1e-3, 1e-2}) {
    options.slope_tolerance = slope_tolerance;
    const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, options);
    const RasterRow row = cut_row(cutter, plan, plan.rows / 2);
    // Where the curve is straight for two sample intervals, one of them lies on the straight part
    // whole, and its direction has to be the path's.
    std::size_t i = 1;
    const double y = plan.row_y(plan.rows / 2);
    std::vector<Eigen::Vector3d> points = row.points;
    if (points.front().x() > points.back().x()) std::reverse(points.begin(), points.end());
    for (double x = 0.1; x < kSide - 0.1; x += 0.0113) {
      const double h = plan.spacing;
      const double before = cutter.drop({x - h, y}).tip;
      const double at = cutter.drop({x, y}).tip;
      const double after = cutter.drop({x + h, y}).tip;
      if (std::abs(before - 2.0 * at + after) > 1e-13) continue;
      while (points[i].x() < x) ++i;
      // A move that begins or ends within the probe may belong to the crease beside it.
      if (points[i].x() < x + plan.spacing || points[i - 1].x() > x - plan.spacing) continue;
      const double path =
          std::atan2(points[i].z() - points[i - 1].z(), points[i].x() - points[i - 1].x());
      EXPECT_NEAR(path, std::atan((after - before) / (2.0 * h)), slope_tolerance * 1.0001);
    }
  }
}

TEST(FinishRaster, LooserTolerancesNeedFewerPoints) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  RasterOptions tight;
  RasterOptions loose;
  loose.tolerance = 0.01;
  loose.slope_tolerance = 0.05;
  const auto count = [&](const RasterOptions& options) {
    const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, options);
    return cut_row(cutter, plan, plan.rows / 2).points.size();
  };
  EXPECT_LT(count(loose) * 3, count(tight));
}

TEST(FinishRaster, FinishesTheSurfaceToTheRim) {
  // A roof that falls towards all four borders at a slope of 0.9: every point of it has to be
  // touched by a ball of the raster, up to the scallops between rows.
  const SurfaceMesh mesh = testing::grid_mesh(41, 41, 2.0, 2.0, [](double x, double y) {
    return -0.9 * std::max(std::abs(x - 1.0), std::abs(y - 1.0));
  });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(2.0), kRadius, {});
  const auto rows = all_rows(cutter, plan, Executor::serial());
  const double scallop = kRadius - std::sqrt(kRadius * kRadius - 0.03 * 0.03 * 1.81);
  for (double along = 0.05; along < 2.0; along += 0.093) {
    for (const Eigen::Vector3d& rim :
         {Eigen::Vector3d(along, 0.0, -0.9), Eigen::Vector3d(2.0, along, -0.9)}) {
      double nearest = 1.0;
      for (const RasterRow& row : rows) {
        for (std::size_t i = 1; i < row.points.size(); ++i) {
          const Eigen::Vector3d a = row.points[i - 1] + Eigen::Vector3d(0.0, 0.0, kRadius);
          const Eigen::Vector3d u = row.points[i] - row.points[i - 1];
          const double part = std::clamp(u.dot(rim - a) / u.squaredNorm(), 0.0, 1.0);
          nearest = std::min(nearest, (a + part * u - rim).norm());
        }
      }
      EXPECT_LE(nearest - kRadius, 1.5 * scallop + 0.0005);
      EXPECT_GE(nearest - kRadius, -0.0005);
    }
  }
}

TEST(FinishRaster, SameRowsForAnyThreads) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  const auto one = all_rows(cutter, plan, Executor::serial());
  const auto two = all_rows(cutter, plan, Executor::cpu(2));
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t r = 0; r < one.size(); ++r) EXPECT_EQ(one[r].points, two[r].points);
}

TEST(FinishRaster, CountsWhatItCuts) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  std::vector<Eigen::Vector3d> path;
  const RasterSummary summary = cut_raster(
      cutter, plan, Executor::serial(),
      [&](const RasterRow& row) { path.insert(path.end(), row.points.begin(), row.points.end()); },
      {});
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
  EXPECT_TRUE(summary.complete);
  EXPECT_EQ(summary.rows, plan.rows);
  EXPECT_EQ(summary.points, static_cast<std::int64_t>(path.size()));
  EXPECT_GE(summary.samples, plan.rows * plan.samples);
  EXPECT_NEAR(summary.length, length, 1e-9);
  EXPECT_DOUBLE_EQ(summary.tip.min().x(), -kRadius);
}

TEST(FinishRaster, StopsWithinABatch) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  std::stop_source source;
  int reports = 0;
  const RunControl control(source.get_token(), [&](const Progress& progress) {
    EXPECT_EQ(progress.total, static_cast<double>(plan.rows));
    if (++reports == 2) source.request_stop();
  });
  const RasterSummary summary = cut_raster(
      cutter, plan, Executor::serial(), [](const RasterRow&) {}, control);
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(reports, 2);
  EXPECT_LT(summary.rows, plan.rows);
}

TEST(FinishRaster, RefusesAHoleInTheSurface) {
  const SurfaceMesh mesh = testing::grid_mesh(5, 5, 1.0, 1.0, [](double, double) { return 1.0; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  EXPECT_THROW(cut_row(cutter, plan, plan.rows / 2), InputError);
}

}  // namespace
}  // namespace lensforge
