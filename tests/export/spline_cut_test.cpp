// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/optics/outline.h"
#include "core/spline/sample_splines.h"
#include "core/temp_folder.h"
#include "design/render.h"
#include "export/export.h"
#include "export/solid/solid_reading.h"
#include "export/spline/spline_net.h"

namespace lensforge::testing {
namespace {

TEST(SplineCut, PatchesAreTheSplineItself) {
  const ControlNet spline = sample_spline();
  const WholeSpline whole{{Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(15.0, 10.0)},
                          {spline.table(0), spline.table(1), spline.table(2)}};
  const SplineNet net = cut_spline(whole, {{0, 4, 5, 11}, {0, 3, 8}}, 1e-12, Executor::serial());
  ASSERT_EQ(net.patches.size(), 6U);
  EXPECT_EQ(net.edges_u.size(), 9U);
  EXPECT_EQ(net.edges_v.size(), 8U);
  for (double u = 0.0; u <= 11.0; u += 0.173) {
    for (double v = 0.0; v <= 8.0; v += 0.191) {
      const SplinePoint point = net.at({u / 11.0 * 15.0, v / 8.0 * 10.0});
      const SplineFrame frame = spline.at({u, v});
      EXPECT_LT((point.xy - frame.point.head<2>()).norm(), 1e-11);
      EXPECT_NEAR(point.surface.z, frame.point.z(), 1e-11);
      EXPECT_LT((point.surface.slope - frame.shape().slope).norm(), 1e-10);
    }
  }
}

TEST(SplineCut, CountsItsControlPointsBeforehand) {
  EXPECT_EQ(net_of(sample_spline(), Executor::serial()).control_points(),
            control_points_of_net(sample_spline()));
}

class SplineLens : public ::testing::Test {
 protected:
  SplineLens() {
    Lens& lens = source_.lens;
    lens.model = SurfaceModel::kSpline;
    lens.spline = sample_spline();
    lens.surface = spline_nodes(*lens.spline, kMeshSamples).mesh;
    lens.setup.lens_size = lens.setup.image_size = {15.0, 10.0};
    lens.setup.pixels = {24, 16};
    lens.target = Image(24, 16, 1.0F);
    source_.file = folder_ / "surface.ply";
    write_bytes(source_.file, "anything");
  }

  ExportResult write(const std::filesystem::path& path) {
    return export_lens(source_, path, {}, Executor::serial());
  }

  TempFolder folder_;
  ExportSource source_;
};

/// Read back by OpenCASCADE, at random points: 1e-6 mm and 1e-6 rad are asked for.
TEST_F(SplineLens, StepHoldsTheVerySurface) {
  const ExportResult result = write(folder_ / "lens.step");
  ASSERT_TRUE(result.splines.has_value());
  EXPECT_FALSE(result.splines->fit.has_value());
  EXPECT_TRUE(result.splines->content.is_one_solid());
  const SolidSurface solid = read_solid_surface(folder_ / "lens.step", 5e4, Executor::serial());
  EXPECT_TRUE(solid.by_name);
  const ControlNet& spline = *source_.lens.spline;
  double height = 0.0;
  double normal = 0.0;
  for (Eigen::Index v = 0; v < solid.samples.mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d p = solid.samples.mesh.vertices.col(v);
    const Eigen::Vector2d start(p.x() / 15.0 * 11.0, p.y() / 10.0 * 8.0);
    const SplineFrame frame = spline.at(spline.parameters_of(p.head<2>(), start));
    height = std::max(height, std::abs(p.z() - frame.point.z()));
    const Eigen::Vector3d expected = frame.normal().normalized();
    normal = std::max(normal, (solid.samples.normals.col(v).normalized() - expected).norm());
  }
  EXPECT_GT(solid.samples.mesh.vertex_count(), 10000);
  EXPECT_LE(height, 1e-9);
  EXPECT_LE(normal, 1e-9);
}

TEST_F(SplineLens, StepProjectsThePictureOfTheDesign) {
  const ExportResult result = write(folder_ / "lens.step");
  const SolidSurface solid =
      read_solid_surface(folder_ / "lens.step", kPictureNodes, Executor::serial());
  const Lens& lens = source_.lens;
  const double designed = evaluate(lens, SurfaceModel::kSpline, nullptr, Executor::serial()).mae;
  const double made = evaluate(solid.samples.mesh, solid.samples.normals, lens.setup, lens.target,
                               nullptr, Executor::serial())
                          .mae;
  EXPECT_GT(designed, 0.01);
  EXPECT_NEAR(made, designed, 1e-7);
  EXPECT_EQ(result.splines->picture.mae, designed);
}

TEST_F(SplineLens, IgesHoldsTheSameSolid) {
  const ExportResult result = write(folder_ / "lens.igs");
  ASSERT_TRUE(result.splines.has_value());
  EXPECT_TRUE(result.splines->content.is_one_solid());
  EXPECT_NEAR(result.splines->content.volume, result.splines->net.volume(),
              1e-6 * result.splines->net.volume());
}

/// Read back by OpenCASCADE: the very surface, as far as the outline goes.
TEST_F(SplineLens, WithAnOutlineIsTheVerySurfaceInsideOfIt) {
  const Outline circle = circle_outline({15.0, 10.0});
  source_.lens.setup.outline = circle;
  const ExportResult result = write(folder_ / "lens.step");
  ASSERT_TRUE(result.splines.has_value());
  EXPECT_FALSE(result.splines->fit.has_value());
  EXPECT_TRUE(result.splines->content.is_one_solid());
  EXPECT_EQ(result.splines->content.faces, 6);
  const SolidSurface solid = read_solid_surface(folder_ / "lens.step", 5e4, Executor::serial());
  const ControlNet& spline = *source_.lens.spline;
  double outside = 0.0;
  double height = 0.0;
  for (Eigen::Index v = 0; v < solid.samples.mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d p = solid.samples.mesh.vertices.col(v);
    const Eigen::Vector2d start(p.x() / 15.0 * 11.0, p.y() / 10.0 * 8.0);
    outside = std::max(outside, (p.head<2>() - Eigen::Vector2d(7.5, 5.0)).norm() - 5.0);
    height = std::max(
        height, std::abs(p.z() - spline.at(spline.parameters_of(p.head<2>(), start)).point.z()));
  }
  EXPECT_GT(solid.samples.mesh.vertex_count(), 10000);
  EXPECT_LE(outside, 1e-5);
  EXPECT_LE(height, 1e-9);
}

TEST_F(SplineLens, HeightsAreThoseOfTheSpline) {
  ExportOptions options;
  options.pixels = 30;
  const ExportResult result =
      export_lens(source_, folder_ / "lens.exr", options, Executor::serial());
  ASSERT_TRUE(result.heights.has_value());
  EXPECT_EQ(result.heights->pixels, (GridShape{30, 20}));
}

}  // namespace
}  // namespace lensforge::testing
