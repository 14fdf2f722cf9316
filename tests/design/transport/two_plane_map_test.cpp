// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/schedule/two_faces.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

constexpr double kLens = 20.0;        // mm
constexpr double kExitHeight = 20.0;  // mm
constexpr int kSide = 12;

/// A screen with a square picture in the middle of the lens's axis.
OpticalSetup square(double width, double z) {
  OpticalSetup setup = testing::setup_of({kLens, kLens}, {kSide, kSide}, z);
  setup.image_size = {width, width};
  setup.image_origin.setConstant(0.5 * (kLens - width));
  return setup;
}

RayBundle bundle_of(const OpticalSetup& first, const Image& a, const OpticalSetup& second,
                    const Image& b) {
  return two_plane_map({first, a}, {second, b}, {kSide, kSide}, kExitHeight, Executor::serial(),
                       {});
}

TEST(TwoPlaneMap, OfEvenSquaresIsLinear) {
  const Image even(kSide, kSide, 1.0F);
  const RayBundle rays = bundle_of(square(10.0, 60.0), even, square(40.0, 260.0), even);
  ASSERT_TRUE(rays.converged);
  ASSERT_EQ(rays.entry.cols(), (kSide + 2) * (kSide + 2));
  const Eigen::Vector2d middle(0.5 * kLens, 0.5 * kLens);
  for (Eigen::Index k = 0; k < rays.entry.cols(); ++k) {
    const Eigen::Vector2d a = rays.first.col(k).head<2>() - middle;
    EXPECT_LT((rays.second.col(k).head<2>() - middle - 4.0 * a).norm(), 0.02);
    // 40 mm before the first screen, where rays part by 3 a in 200 mm.
    EXPECT_LT((rays.exit.col(k) - middle - 0.4 * a).norm(), 0.005);
    EXPECT_LT((rays.entry.col(k) - middle - 2.0 * a).norm(), 0.01);
  }
}

TEST(TwoPlaneMap, BringsThreeQuartersOfTheLightToABrightHalf) {
  Image bright(kSide, kSide, 1.0F);
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide / 2; ++column) bright.at(column, row) = 3.0F;
  }
  const Image even(kSide, kSide, 1.0F);
  const RayBundle rays = bundle_of(square(kLens, 60.0), bright, square(kLens, 260.0), even);
  ASSERT_TRUE(rays.converged);
  for (Eigen::Index k = 0; k < rays.entry.cols(); ++k) {
    // Columns of pixels run against x: the half of greater x is bright.
    const double a = rays.first(0, k) / kLens;
    const double b = rays.second(0, k) / kLens;
    EXPECT_NEAR(a, b < 0.25 ? 2.0 * b : 0.5 + (b - 0.25) / 1.5, 1e-3);
    EXPECT_NEAR(rays.second(1, k), rays.first(1, k), 0.02);
  }
}

}  // namespace
}  // namespace lensforge
