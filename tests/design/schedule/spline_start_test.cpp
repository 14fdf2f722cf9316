// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/spline_start.h"

#include <gtest/gtest.h>

#include "core/lens/smooth_surface.h"
#include "core/lens/surface_check.h"
#include "core/spline/sample_splines.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

const Eigen::Vector2d kLensSize(24.0, 20.0);

TEST(SplineStart, HasTheSlopesOfTheMeshAndItsRectangle) {
  const SurfaceMesh mesh = testing::height_field(kLensSize, {49, 47}, &testing::bumps);
  const ControlNet net =
      spline_through(mesh, kLensSize, {99, 83}, 1.0, Executor::serial(), RunControl());
  EXPECT_FALSE(spline_fault(net, testing::setup_of(kLensSize, {24, 20}, 60.0)));
  const SmoothSurface surface(mesh);
  for (double x = 3.0; x < 21.0; x += 1.37) {
    for (double y = 3.0; y < 17.0; y += 1.19) {
      const Eigen::Vector2d start(x / kLensSize.x() * 96.0, y / kLensSize.y() * 80.0);
      const SurfaceShape shape = net.at(net.parameters_of({x, y}, start)).shape();
      EXPECT_LT((shape.slope - surface.model_at({x, y})->slope).norm(), 5e-4);
    }
  }
}

TEST(SplineStart, SettledRestsOnTheThicknessAndKeepsTheRim) {
  const ControlNet net = settled(testing::sample_spline(), 3.0);
  EXPECT_NEAR(spline_nodes(net, kMeshSamples).mesh.vertices.row(2).minCoeff(), 3.0, 2e-9);
  EXPECT_FALSE(spline_fault(net, testing::setup_of({15.0, 10.0}, {24, 16}, 60.0)));
  const Eigen::Matrix3Xd moved = net.points - testing::sample_spline().points;
  EXPECT_LE(moved.topRows<2>().cwiseAbs().maxCoeff(), 0.5001e-7);
  EXPECT_LT(moved.row(2).maxCoeff() - moved.row(2).minCoeff(), 1.001e-9);
}

}  // namespace
}  // namespace lensforge
