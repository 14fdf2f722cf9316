// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "cam/cam_meshes.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled_paths.h"
#include "cam/milled_tiles.h"
#include "core/error.h"
#include "core/lens/smooth_surface.h"

namespace lensforge {
namespace {

SurfaceMesh shaken_relief() {
  SurfaceMesh mesh = testing::grid_mesh(14, 17, 3.0, 4.0, testing::lens_relief);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> shake(-0.05, 0.05);
  for (int r = 1; r < 16; ++r) {
    for (int c = 1; c < 13; ++c) {
      mesh.vertices.col(r * 14 + c) += Eigen::Vector3d(shake(random), shake(random), shake(random));
    }
  }
  return mesh;
}

TEST(FacetField, EqualsThePlaneOfTheTriangleUnderEveryNode) {
  const SurfaceMesh mesh = shaken_relief();
  const FacetField field(mesh);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({0.0, 0.0}, 0.0125, 241, 321));
  for (std::int64_t n = 0; n < patch.window.size(); n += 7) {
    const Eigen::Vector2d q = patch.window.node(n % 241, n / 241);
    const auto i = static_cast<std::size_t>(n);
    double most = -1.0;
    double z = 0.0;
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      Eigen::Matrix3d corners;
      corners << mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2);
      Eigen::Matrix3d system = corners;
      system.row(2).setOnes();
      const Eigen::Vector3d weights = system.inverse() * Eigen::Vector3d(q.x(), q.y(), 1.0);
      if (weights.minCoeff() <= most) continue;
      most = weights.minCoeff();
      z = corners.row(2).dot(weights);
    }
    EXPECT_NEAR(patch.z[i], z, 1e-12);
    const std::int64_t t = patch.cut[i];
    const Eigen::Vector3d normal =
        (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
    EXPECT_NEAR(patch.slope_x[i], -normal.x() / normal.z(), 1e-13);
    EXPECT_NEAR(patch.slope_y[i], -normal.y() / normal.z(), 1e-13);
  }
}

TEST(FacetField, ContinuesTheRimByAHundredthAndRefusesMore) {
  const SurfaceMesh mesh = testing::grid_mesh(
      5, 5, 1.0, 1.0, [](double x, double y) { return 2.0 + 0.1 * x - 0.2 * y; });
  const FacetField field(mesh);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({-0.01, -0.01}, 0.51, 3, 3));
  for (std::int64_t n = 0; n < 9; ++n) {
    const Eigen::Vector2d q = patch.window.node(n % 3, n / 3);
    EXPECT_NEAR(patch.z[static_cast<std::size_t>(n)], 2.0 + 0.1 * q.x() - 0.2 * q.y(), 1e-14);
  }
  EXPECT_THROW(testing::sampled(field, testing::window_at({-0.1, 0.5}, 0.1, 2, 2)), InputError);
}

TEST(FacetField, SameBitsForAnyTilesAndThreads) {
  const SurfaceMesh mesh = shaken_relief();
  testing::expect_same_bits_in_tiles(FacetField(mesh),
                                     testing::window_at({0.0, 0.0}, 0.0157, 150, 180));
}

TEST(SmoothField, EqualsTheSmoothSurfaceAndHasItsSlopes) {
  const SmoothSurface surface(shaken_relief());
  const SmoothField field(surface);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({0.0, 0.0}, 0.0125, 241, 321));
  EXPECT_TRUE(patch.cut.empty());
  for (std::int64_t n = 0; n < patch.window.size(); n += 3) {
    const auto point = surface.at(patch.window.node(n % 241, n / 241));
    ASSERT_TRUE(point.has_value());
    const auto i = static_cast<std::size_t>(n);
    EXPECT_NEAR(patch.z[i], point->z, 1e-12);
    EXPECT_NEAR(patch.slope_x[i], point->slope.x(), 1e-9);
    EXPECT_NEAR(patch.slope_y[i], point->slope.y(), 1e-9);
  }
}

TEST(SmoothField, ContinuesTheRimOnItsTangentPlane) {
  const SmoothSurface surface(testing::grid_mesh(
      5, 5, 1.0, 1.0, [](double x, double y) { return 2.0 + 0.1 * x - 0.2 * y; }));
  const SmoothField field(surface);
  const SurfacePatch patch =
      testing::sampled(field, testing::window_at({-0.01, -0.01}, 0.51, 3, 3));
  for (std::int64_t n = 0; n < 9; ++n) {
    const Eigen::Vector2d q = patch.window.node(n % 3, n / 3);
    EXPECT_NEAR(patch.z[static_cast<std::size_t>(n)], 2.0 + 0.1 * q.x() - 0.2 * q.y(), 1e-13);
  }
}

TEST(SmoothField, SameBitsForAnyTilesAndThreads) {
  const SmoothSurface surface(shaken_relief());
  testing::expect_same_bits_in_tiles(SmoothField(surface),
                                     testing::window_at({0.0, 0.0}, 0.0157, 150, 180));
}

}  // namespace
}  // namespace lensforge
