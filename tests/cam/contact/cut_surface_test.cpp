// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/cut_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cam/adversarial_meshes.h"
#include "cam/path/finish_raster.h"

namespace lensforge::cut_surface_test {
namespace {

constexpr double kRadius = 0.2;
constexpr double kSide = 4.0;

SurfaceMesh relief() {
  return testing::grid_mesh(21, 23, kSide, kSide, [](double x, double y) {
    return testing::lens_relief(2.0 * x, 2.0 * y) + 0.05 * std::abs(x - 1.7 + 0.3 * y);
  });
}

Eigen::AlignedBox2d square() { return {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kSide, kSide)}; }

/// Largest difference between facets and the smooth surface, at many places of each facet.
SurfaceDeviation looked_up(const SurfaceMesh& facets, const OpticalSurface& surface) {
  SurfaceDeviation found;
  for (std::int64_t t = 0; t < facets.triangle_count(); ++t) {
    const Eigen::Vector3d a = facets.corner(t, 0);
    const Eigen::Vector3d u = facets.corner(t, 1) - a;
    const Eigen::Vector3d v = facets.corner(t, 2) - a;
    const Eigen::Vector3d n = u.cross(v);
    const Eigen::Vector2d slope = -n.head<2>() / n.z();
    for (const auto& [s, r] : {std::pair{0.33, 0.33},
                               {0.02, 0.02},
                               {0.96, 0.02},
                               {0.02, 0.96},
                               {0.49, 0.02},
                               {0.02, 0.49},
                               {0.49, 0.49}}) {
      const Eigen::Vector3d q = a + s * u + r * v;
      const auto exact = surface.at(q.head<2>());
      if (!exact) continue;
      found.height = std::max(found.height, std::abs(q.z() - exact->z));
      found.slope = std::max(found.slope, (slope - exact->slope).norm());
    }
  }
  return found;
}

TEST(CutSurface, FacetsOfASmoothSurfaceKeepItsDeviation) {
  for (const double slope : {0.04, 0.01}) {
    SmoothCutOptions options;
    options.slope_deviation = slope;
    const SmoothCutSurface surface(relief(), kRadius, options, Executor::serial());
    const SurfaceMesh facets = surface.facets(square(), Executor::serial());
    EXPECT_EQ(facets.triangle_count(), surface.facet_count());
    const SurfaceDeviation stated = surface.deviation();
    const SurfaceDeviation found = looked_up(facets, surface.surface());
    EXPECT_LE(found.height, stated.height);
    EXPECT_LE(found.slope, stated.slope);
    EXPECT_GE(found.slope, 0.1 * stated.slope);
    EXPECT_LT(stated.slope, 0.04);
  }
}

TEST(CutSurface, FinerFacetsComeCloserToTheSmoothSurface) {
  SmoothCutOptions coarse;
  coarse.slope_deviation = 0.02;
  coarse.deviation = 1.0;
  SmoothCutOptions fine = coarse;
  fine.slope_deviation = 0.01;
  const SmoothCutSurface a(relief(), kRadius, coarse, Executor::serial());
  const SmoothCutSurface b(relief(), kRadius, fine, Executor::serial());
  EXPECT_GT(b.facet_count(), 2 * a.facet_count());
  EXPECT_LT(b.deviation().height, 0.5 * a.deviation().height);
}

TEST(CutSurface, APlaneStaysAsItIs) {
  const SurfaceMesh plane =
      testing::grid_mesh(9, 9, kSide, kSide, [](double x, double y) { return 0.2 * x - 0.1 * y; });
  const SmoothCutSurface surface(plane, kRadius, {}, Executor::serial());
  EXPECT_EQ(surface.facet_count(), plane.triangle_count());
  EXPECT_LT(surface.deviation().height, 1e-12);
}

TEST(CutSurface, SameRowsForAnyBandAndThreads) {
  const SurfaceMesh mesh = relief();
  RasterOptions raster;
  raster.pitch = 0.2;
  raster.arcs = true;
  const RasterPlan plan = plan_finish_raster(square(), kRadius, raster);
  std::vector<std::vector<Eigen::Vector3d>> ends;
  for (const std::int64_t at_once : {1, 20'000, 100'000'000}) {
    SmoothCutOptions options;
    options.slope_deviation = 0.02;
    options.facets_at_once = at_once;
    const Executor executor = at_once == 1 ? Executor::serial() : Executor::cpu(2);
    const SmoothCutSurface surface(mesh, kRadius, options, executor);
    std::vector<Eigen::Vector3d> path;
    const auto sink = [&](const RasterRow& row) {
      path.push_back(row.start);
      for (const PathMove& move : row.moves) path.insert(path.end(), {move.end, move.centre});
    };
    EXPECT_TRUE(cut_raster(surface, plan, executor, sink, {}).complete);
    ends.push_back(std::move(path));
  }
  EXPECT_EQ(ends[0], ends[1]);
  EXPECT_EQ(ends[0], ends[2]);
}

/// The smooth surface through points of a paraboloid has no creases, so few arcs say what hundreds
/// of facets do.
TEST(CutSurface, ASmoothSurfaceNeedsFewerMovesThanItsFacets) {
  const SurfaceMesh mesh = testing::grid_mesh(28, 31, kSide, kSide, [](double x, double y) {
    return 0.05 * (x - 2.0) * (x - 2.0) - 0.04 * (y - 1.0) * (y - 1.0);
  });
  RasterOptions raster;
  raster.arcs = true;
  raster.slope_tolerance = 2e-3;
  const RasterPlan plan = plan_finish_raster(square(), kRadius, raster);
  SmoothCutOptions options;
  options.slope_deviation = 1e-3;
  const SmoothCutSurface smooth(mesh, kRadius, options, Executor::serial());
  const FacetCutSurface facets(mesh, kRadius, Executor::serial());
  const auto moves = [&](const CutSurface& surface) {
    const RowSpan span = plan.row_span(plan.rows / 2);
    const Eigen::AlignedBox2d axis(span.line.at(span.held_from), span.line.at(span.held_to));
    const RowCurves curves(surface, axis, Executor::serial());
    return cut_row(curves, plan, plan.rows / 2).moves.size();
  };
  EXPECT_LT(2 * moves(smooth), moves(facets));
}

}  // namespace
}  // namespace lensforge::cut_surface_test
