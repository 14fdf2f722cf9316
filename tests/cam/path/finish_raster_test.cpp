// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/finish_raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "cam/cam_meshes.h"
#include "core/error.h"
#include "machine/gcode/gcode_motion.h"

namespace lensforge::finish_raster_test {
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

FacetCutSurface facets(const SurfaceMesh& mesh) { return {mesh, kRadius, Executor::serial()}; }

std::vector<RasterRow> all_rows(const CutSurface& surface, const RasterPlan& plan,
                                const Executor& executor) {
  std::vector<RasterRow> rows;
  cut_raster(surface, plan, executor, [&](const RasterRow& row) { rows.push_back(row); }, {});
  return rows;
}

std::vector<Eigen::Vector3d> points_of(const RasterRow& row) {
  std::vector<Eigen::Vector3d> points{row.start};
  for (const PathMove& move : row.moves) points.push_back(move.end);
  return points;
}

TEST(FinishRaster, RowsLieOnBothBordersAndNoFartherApartThanThePitch) {
  const RasterPlan plan = plan_finish_raster(square(100.0), kRadius, {});
  EXPECT_EQ(plan.rows - 2 * plan.rows_outside, 1668);
  EXPECT_EQ(plan.row_place(plan.rows_outside), 0.0);
  EXPECT_EQ(plan.row_place(plan.rows - 1 - plan.rows_outside), 100.0);
  EXPECT_LE(plan.row_place(0), -plan.reach());
  EXPECT_GE(plan.row_place(plan.rows - 1), 100.0 + plan.reach());
  for (std::int64_t row = 1; row < plan.rows; ++row) {
    EXPECT_LE(plan.row_place(row) - plan.row_place(row - 1), 0.06 + 1e-4);
  }
}

TEST(FinishRaster, AWholeNumberOfPitchesCostsNoRowMore) {
  const RasterPlan plan = plan_finish_raster(square(3.0), kRadius, {});
  EXPECT_EQ(plan.rows - 2 * plan.rows_outside, 51);
  EXPECT_DOUBLE_EQ(plan.pitch, 0.06);
}

TEST(FinishRaster, ZigZagsAndTurnsAroundOutsideTheRim) {
  const SurfaceMesh mesh = small_relief();
  for (const int along : {0, 1}) {
    RasterOptions options;
    options.along = along;
    const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, options);
    const auto rows = all_rows(facets(mesh), plan, Executor::serial());
    ASSERT_EQ(static_cast<std::int64_t>(rows.size()), plan.rows);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const auto points = points_of(rows[r]);
      const bool forward = r % 2 == 0;
      EXPECT_DOUBLE_EQ((forward ? points.front() : points.back())[along], -kRadius);
      EXPECT_DOUBLE_EQ((forward ? points.back() : points.front())[along], kSide + kRadius);
      for (std::size_t i = 1; i < points.size(); ++i) {
        EXPECT_EQ(points[i][along] > points[i - 1][along], forward);
        EXPECT_EQ(points[i][1 - along], plan.row_place(static_cast<std::int64_t>(r)));
      }
    }
  }
}

/// Climbing, a spindle that turns clockwise has the rows still to come on its right.
TEST(FinishRaster, OneWayRowsKeepTheMaterialOnOneSide) {
  for (const int along : {0, 1}) {
    for (const PassStyle style : {PassStyle::kClimb, PassStyle::kConventional}) {
      RasterOptions options;
      options.along = along;
      options.style = style;
      const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, options);
      Eigen::Vector2d way = Eigen::Vector2d::Unit(along) * (plan.forward(0) ? 1.0 : -1.0);
      const Eigen::Vector2d right(way.y(), -way.x());
      const Eigen::Vector2d ahead = Eigen::Vector2d::Unit(1 - along);
      EXPECT_EQ(right.dot(ahead) > 0.0, style == PassStyle::kClimb);
      EXPECT_EQ(plan.forward(0), plan.forward(1));
    }
  }
}

/// Every move with its arcs as a controller runs them, against the drop-cutter at many places.
TEST(FinishRaster, TheProgramsMotionKeepsTheCertificate) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  for (const int along : {0, 1}) {
    RasterOptions options;
    options.along = along;
    options.arcs = true;
    options.slope_tolerance = 5e-3;
    options.tolerance = 0.001;
    const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, options);
    int arcs = 0;
    for (const std::int64_t r : {20, 33, 50}) {
      const RasterRow row = cut_row(RowCurves(cutter), plan, r);
      EXPECT_LE(row.certificate.gouge.value, options.tolerance);
      EXPECT_LE(row.certificate.excess.value, options.tolerance);
      Eigen::Vector3d from = row.start;
      for (const PathMove& move : row.moves) {
        ArcRequest request{along == 0 ? ArcPlane::kZX : ArcPlane::kYZ, move.clockwise,
                           move.centre - from, std::nullopt};
        const ArcResult arc = move.arc_axis >= 0 ? make_arc(from, move.end, request) : ArcResult{};
        ASSERT_EQ(arc.reason, "");
        EXPECT_LT(std::abs(arc.arc.sweep), 3.1);
        arcs += move.arc_axis >= 0 ? 1 : 0;
        for (double part = 0.0; part <= 1.0; part += 0.05) {
          const Eigen::Vector3d tip = move.arc_axis >= 0
                                          ? arc.arc.at(part)
                                          : Eigen::Vector3d(from + part * (move.end - from));
          if (tip[along] < 0.0 || tip[along] > kSide) continue;
          const double error = tip.z() - cutter.drop(tip.head<2>()).tip;
          ASSERT_LE(error, row.certificate.excess.value + 1e-9);
          ASSERT_GE(error, -row.certificate.gouge.value - 1e-9);
        }
        from = move.end;
      }
    }
    EXPECT_GT(arcs, 10);
  }
}

TEST(FinishRaster, LinksBetweenRowsDoNotTouchThePart) {
  const SurfaceMesh mesh = small_relief();
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  const auto rows = all_rows(facets(mesh), plan, Executor::serial());
  for (std::size_t r = 1; r < rows.size(); ++r) {
    const Eigen::Vector3d from = rows[r - 1].end();
    const Eigen::Vector3d link = rows[r].start - from;
    EXPECT_EQ(link.x(), 0.0);
    for (double part = 0.0; part <= 1.0; part += 0.02) {
      const Eigen::Vector3d tip = from + part * link;
      const double clearance = tip.z() - cutter.drop(tip.head<2>()).tip;
      EXPECT_GT(clearance, 0.5 * kRadius);
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
    return cut_row(RowCurves(cutter), plan, plan.rows / 2).moves.size();
  };
  EXPECT_LT(count(loose) * 3, count(tight));
}

TEST(FinishRaster, FinishesTheSurfaceToTheRim) {
  // A roof that falls towards all four borders at a slope of 0.9: every point of it has to be
  // touched by a ball of the raster, up to the scallops between rows.
  const SurfaceMesh mesh = testing::grid_mesh(41, 41, 2.0, 2.0, [](double x, double y) {
    return -0.9 * std::max(std::abs(x - 1.0), std::abs(y - 1.0));
  });
  const RasterPlan plan = plan_finish_raster(square(2.0), kRadius, {});
  std::vector<std::vector<Eigen::Vector3d>> rows;
  for (const RasterRow& row : all_rows(facets(mesh), plan, Executor::serial())) {
    rows.push_back(points_of(row));
  }
  const double scallop = kRadius - std::sqrt(kRadius * kRadius - 0.03 * 0.03 * 1.81);
  for (double along = 0.05; along < 2.0; along += 0.093) {
    for (const Eigen::Vector3d& rim :
         {Eigen::Vector3d(along, 0.0, -0.9), Eigen::Vector3d(2.0, along, -0.9)}) {
      double nearest = 1.0;
      for (const auto& row : rows) {
        for (std::size_t i = 1; i < row.size(); ++i) {
          const Eigen::Vector3d a = row[i - 1] + Eigen::Vector3d(0.0, 0.0, kRadius);
          const Eigen::Vector3d u = row[i] - row[i - 1];
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
  RasterOptions options;
  options.arcs = true;
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, options);
  const auto one = all_rows(facets(mesh), plan, Executor::serial());
  const auto two = all_rows(facets(mesh), plan, Executor::cpu(2));
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t r = 0; r < one.size(); ++r) {
    EXPECT_EQ(points_of(one[r]), points_of(two[r]));
    EXPECT_EQ(one[r].certificate.slope.value, two[r].certificate.slope.value);
  }
}

TEST(FinishRaster, CountsWhatItCuts) {
  const SurfaceMesh mesh = small_relief();
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  std::vector<Eigen::Vector3d> path;
  double gouge = 0.0;
  const auto sink = [&](const RasterRow& row) {
    const auto points = points_of(row);
    path.insert(path.end(), points.begin(), points.end());
    gouge = std::max(gouge, row.certificate.gouge.value);
  };
  const RasterSummary summary = cut_raster(facets(mesh), plan, Executor::serial(), sink, {});
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
  EXPECT_TRUE(summary.complete);
  EXPECT_EQ(summary.rows, plan.rows);
  EXPECT_EQ(summary.points, static_cast<std::int64_t>(path.size()));
  EXPECT_EQ(summary.certificate.gouge.value, gouge);
  EXPECT_GT(gouge, 0.0);
  EXPECT_NEAR(summary.length, length, 1e-9);
  EXPECT_DOUBLE_EQ(summary.tip.min().x(), -kRadius);
}

TEST(FinishRaster, StopsWithinABatch) {
  const SurfaceMesh mesh = small_relief();
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  std::stop_source source;
  int reports = 0;
  const RunControl control(source.get_token(), [&](const Progress& progress) {
    EXPECT_EQ(progress.total, static_cast<double>(plan.rows));
    if (++reports == 2) source.request_stop();
  });
  const RasterSummary summary = cut_raster(
      facets(mesh), plan, Executor::serial(), [](const RasterRow&) {}, control);
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(reports, 2);
  EXPECT_LT(summary.rows, plan.rows);
}

TEST(FinishRaster, EveryRowIsReportedByTheCallersThread) {
  const SurfaceMesh mesh = small_relief();
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  const std::thread::id caller = std::this_thread::get_id();
  for (const Executor& executor : {Executor::serial(), Executor::cpu(2)}) {
    std::vector<double> rows;
    const RunControl control({}, [&](const Progress& progress) {
      EXPECT_EQ(std::this_thread::get_id(), caller);
      EXPECT_EQ(progress.stage, "cam finish");
      rows.push_back(progress.done);
    });
    cut_raster(
        facets(mesh), plan, executor, [](const RasterRow&) {}, control);
    EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end()));
    EXPECT_EQ(rows.back(), static_cast<double>(plan.rows));
    if (executor.concurrency() > 1) continue;
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    EXPECT_EQ(static_cast<std::int64_t>(rows.size()), plan.rows);  // No row is passed over.
  }
}

TEST(FinishRaster, PitchForAScallopLeavesThatScallopOnSlopes) {
  FinishProcess process;
  process.scallop = 0.002;
  const double pitch = max_pitch(process, kRadius, 0.0);
  EXPECT_NEAR(kRadius - std::sqrt(kRadius * kRadius - 0.25 * pitch * pitch), 0.002, 1e-15);
  // On a slope of 1 the distance along the surface is √2 times that of the rows.
  EXPECT_NEAR(max_pitch(process, kRadius, 1.0) * std::sqrt(2.0), pitch, 1e-15);
}

TEST(FinishRaster, DecimalsFollowFromTheTolerances) {
  EXPECT_EQ(decimals_for(0.0005, 1e-3), 6);
  EXPECT_EQ(decimals_for(0.0005, 8e-3), 5);
  EXPECT_EQ(decimals_for(0.0005, 0.5), 4);
  EXPECT_EQ(decimals_for(0.0001, 0.5), 5);
}

TEST(FinishRaster, RefusesAHoleInTheSurface) {
  const SurfaceMesh mesh = testing::grid_mesh(5, 5, 1.0, 1.0, [](double, double) { return 1.0; });
  const DropCutter cutter(mesh, kRadius, Executor::serial());
  const RasterPlan plan = plan_finish_raster(square(kSide), kRadius, {});
  EXPECT_THROW(cut_row(RowCurves(cutter), plan, plan.rows / 2), InputError);
}

}  // namespace
}  // namespace lensforge::finish_raster_test
