// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/smooth_surface.h"

#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "core/mesh/surface_mesh.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

TEST(SmoothSurface, HasTheDesignsNormalsAboveTheVerticesAndHeightsToFit) {
  for (const SurfaceMesh& mesh : {smooth_lens(), creased_lens(), noisy_lens()}) {
    const SmoothSurface surface(mesh);
    const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
    const Eigen::VectorXd heights = heights_from_slopes(mesh, surface.slopes());
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
      const auto point = surface.at(mesh.vertices.col(v).head<2>());
      ASSERT_TRUE(point);
      EXPECT_NEAR(point->z, heights[v], 1e-12);
      const Eigen::Vector3d normal(-point->slope.x(), -point->slope.y(), 1.0);
      EXPECT_LT((normal.normalized() - normals.col(v).normalized()).norm(), 1e-10);
    }
  }
}

TEST(SmoothSurface, KeepsAPlane) {
  const SmoothSurface surface(surface_of(
      {10.0, 8.0}, {12, 11}, [](double x, double y) { return 5.0 + 0.3 * x - 0.2 * y; }));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d xy(10.0 * unit(random), 8.0 * unit(random));
    const auto point = surface.at(xy);
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->z, 5.0 + 0.3 * xy.x() - 0.2 * xy.y(), 1e-12);
    EXPECT_NEAR(point->slope.x(), 0.3, 1e-11);
    EXPECT_NEAR(point->slope.y(), -0.2, 1e-11);
  }
}

/// A paraboloid's slopes at the inner vertices of the even grid are exact, and with exact slopes
/// the reduced Clough–Tocher triangle reproduces quadratics. On the border normals lean inwards,
/// which moves the rest up or down.
TEST(SmoothSurface, KeepsAParaboloidAwayFromTheBorder) {
  const auto height = [](double x, double y) { return 5.0 + 0.01 * x * x + 0.02 * x * y; };
  const SmoothSurface surface(surface_of({24.0, 24.0}, {25, 29}, height));
  const double shift = surface.at({12.0, 12.0})->z - height(12.0, 12.0);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> inside(8.0, 16.0);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d xy(inside(random), inside(random));
    const auto point = surface.at(xy);
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->z, height(xy.x(), xy.y()) + shift, 1e-3);
    EXPECT_NEAR(point->slope.x(), 0.02 * xy.x() + 0.02 * xy.y(), 3e-4);
    EXPECT_NEAR(point->slope.y(), 0.02 * xy.x(), 3e-4);
  }
}

TEST(SmoothSurface, SlopesAreTheDerivativesOfHeightAndContinuous) {
  const SmoothSurface surface(noisy_lens());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.001, 0.999);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector2d xy(30.0 * unit(random), 24.0 * unit(random));
    const auto point = surface.at(xy);
    ASSERT_TRUE(point);
    for (const auto& [axis, step] : {std::pair{0, 1e-5}, {0, 5e-6}, {1, 1e-5}, {1, 5e-6}}) {
      const Eigen::Vector2d way = step * Eigen::Vector2d::Unit(axis);
      const auto after = surface.at(xy + way);
      const auto before = surface.at(xy - way);
      ASSERT_TRUE(after && before);
      EXPECT_NEAR((after->z - before->z) / (2.0 * step), point->slope[axis], 1e-6);
      EXPECT_LT((after->slope - before->slope).norm(), 5.0 * step);
    }
  }
}

TEST(SmoothSurface, HasNoPointOffTheMesh) {
  const SmoothSurface surface(smooth_lens());
  EXPECT_FALSE(surface.at({-0.01, 5.0}));
  EXPECT_FALSE(surface.at({5.0, 24.01}));
  EXPECT_TRUE(surface.at({0.0, 0.0}));
  EXPECT_TRUE(surface.at({30.0, 24.0}));
}

}  // namespace
}  // namespace lensforge::testing
