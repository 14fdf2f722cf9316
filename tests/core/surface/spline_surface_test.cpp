// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "core/lens/optical_surface.h"
#include "core/surface/sample_splines.h"

namespace lensforge::testing {
namespace {

TEST(SplineSurface, IsTheSplineAboveEveryPoint) {
  const SplineSurface surface(sample_spline());
  EXPECT_FALSE(surface.has_creases());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const double u = 11.0 * unit(random);
    const SplineFrame frame = surface.net().at({u, 8.0 * unit(random)});
    const auto point = surface.at(frame.point.head<2>());
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->z, frame.point.z(), 1e-12);
    EXPECT_LT((point->slope - frame.shape().slope).norm(), 1e-11);
  }
  EXPECT_FALSE(surface.at({-0.1, 5.0}));
  EXPECT_FALSE(surface.at({7.0, 10.1}));
}

TEST(SplineSurface, SecondDerivativesAreContinuous) {
  const SplineSurface surface(sample_spline());
  for (double x = 0.05; x < 14.9; x += 0.0317) {
    const auto shape_at = [&](double at) {
      return surface.net()
          .at(surface.net().parameters_of({at, 4.3}, {at / 15.0 * 11.0, 3.4}))
          .shape();
    };
    EXPECT_LT((shape_at(x + 1e-6).bend - shape_at(x).bend).norm(), 1e-5) << x;
  }
}

/// Patches are cubics: four times smaller triangles would have errors some sixty times smaller.
TEST(SplineSurface, PatchesAreTheSurfaceToTheFourthOrder) {
  const SplineSurface surface(sample_spline());
  for (Eigen::Index t = 0; t < surface.mesh().triangle_count(); ++t) {
    const Eigen::Vector3d middle = Eigen::Vector3d::Constant(1.0 / 3.0);
    const SmoothPatch patch = surface.patch_in(t, middle);
    for (const Eigen::Vector3d& weights :
         {Eigen::Vector3d(1.0, 0.0, 0.0), middle, Eigen::Vector3d(0.2, 0.5, 0.3)}) {
      Eigen::Vector2d xy(0.0, 0.0);
      for (int k = 0; k < 3; ++k) xy += weights[k] * surface.mesh().corner(t, k).head<2>();
      const SurfaceShape shape = surface.shape_in(t, weights);
      EXPECT_NEAR(patch.at(xy).z, shape.z, 2e-5);
      EXPECT_LT((patch.at(xy).slope - shape.slope).norm(), 2e-4);
    }
  }
}

TEST(SplineSurface, BendRangesHoldInsideTheirTriangles) {
  const SplineSurface surface(sample_spline());
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  double widest = 0.0;
  for (Eigen::Index t = 0; t < surface.mesh().triangle_count(); ++t) {
    Eigen::Vector3d weights(unit(random), unit(random), unit(random));
    weights /= weights.sum();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(surface.shape_in(t, weights).bend);
    const BendRange range = surface.bend_range(t);
    widest = std::max(widest, range.largest - range.least);
    // What lies between the corners of half a knot cell: a hundredth of the bends of all.
    EXPECT_GE(solver.eigenvalues()[0], range.least - 2e-3) << t;
    EXPECT_LE(solver.eigenvalues()[1], range.largest + 2e-3) << t;
  }
  EXPECT_GT(widest, 0.01);
}

}  // namespace
}  // namespace lensforge::testing
