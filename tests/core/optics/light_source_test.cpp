// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_source.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "core/optics/light_path.h"

namespace lensforge {
namespace {

/// Mean and covariance of a source's light over its points.
struct Moments {
  double whole = 0.0;
  Eigen::Vector2d mean{0.0, 0.0};
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
};

Moments moments_of(const std::vector<SourcePoint>& points) {
  Moments m;
  for (const SourcePoint& point : points) {
    m.whole += point.share;
    m.mean += point.share * point.at;
    m.spread += point.share * point.at * point.at.transpose();
  }
  return m;
}

TEST(SourcePoints, ADiscHasItsCentreAndItsSecondMoments) {
  const Moments m = moments_of(source_points({4.0, {}}, 2000));
  EXPECT_NEAR(m.whole, 1.0, 1e-12);
  EXPECT_LT(m.mean.norm(), 0.002);
  // r² / 4 along each axis.
  EXPECT_LT((m.spread - Eigen::Matrix2d::Identity()).cwiseAbs().maxCoeff(), 0.002);
}

TEST(SourcePoints, EveryOtherPointIsADiscAsWell) {
  const std::vector<SourcePoint> all = source_points({4.0, {}}, 400);
  std::vector<SourcePoint> half;
  for (std::size_t i = 0; i < all.size(); i += 2) half.push_back({all[i].at, 2.0 * all[i].share});
  EXPECT_LT(moments_of(half).mean.norm(), 0.05);
}

TEST(SourcePoints, AShapeHasItsBrightPixelWhereItIsSeen) {
  // Upper right of 2 × 2 pixels, 6 wide.
  const SourceShape shape{2, 2, {0.0, 3.0, 0.0, 1.0}};
  const Moments m = moments_of(source_points({6.0, shape}, 200));
  EXPECT_NEAR(m.whole, 1.0, 1e-12);
  EXPECT_NEAR(m.mean.x(), 1.5, 1e-12);
  EXPECT_NEAR(m.mean.y(), 0.75 * 1.5 - 0.25 * 1.5, 1e-12);
}

TEST(SourcePoints, AFewPointsOfAShapeHaveItsLightAndCentre) {
  // A ring around another place than the middle.
  SourceShape shape{16, 12, {}};
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      const double radius = std::hypot(c - 9.0, r - 5.0);
      shape.weights.push_back(radius > 2.5 && radius < 5.5 ? 1.0 + 0.1 * c : 0.0);
    }
  }
  const SourceExtent extent{8.0, shape};
  const std::vector<SourcePoint> all = source_points(extent, 1000);
  const std::vector<SourcePoint> few = source_points(extent, 9);
  EXPECT_GT(all.size(), 60U);
  EXPECT_LE(few.size(), 16U);
  const Moments exact = moments_of(all);
  const Moments m = moments_of(few);
  EXPECT_NEAR(m.whole, 1.0, 1e-12);
  EXPECT_LT((m.mean - exact.mean).norm(), 1e-12);
  // Each block misses at most its own spread, about 4 pixels' side squared over 12.
  const double side = 4.0 * 8.0 / 16.0;
  EXPECT_LT((m.spread - exact.spread).cwiseAbs().maxCoeff(), side * side / 12.0);
}

TEST(SourcePoints, ThroughAThinLensTheImageIsTurnedAndScaledByTheDistances) {
  OpticalSetup setup;
  setup.extent.width = 1e-3;
  const Eigen::Vector2d per_mm = LightPath(setup).plane().pixels_per_mm();
  const Eigen::Matrix2d parallel = source_motion(setup, 0.0);
  const Eigen::Matrix2d expected = -setup.focal_length * Eigen::Matrix2d(per_mm.asDiagonal());
  EXPECT_LT((parallel - expected).norm(), 1e-5 * expected.norm());

  setup.lamp = PointSource{{50.0, 50.0, -600.0}, Emission::kIsotropic};
  const Eigen::Matrix2d point = source_motion(setup, 0.0);
  EXPECT_LT((point - expected / 600.0).norm(), 1e-5 * point.norm());
}

TEST(SourcePoints, ATiltedScreenStretchesTheImageOneWay) {
  OpticalSetup setup;
  setup.extent.width = 1e-3;
  const double flat = source_blur(setup, 5.0);
  EXPECT_NEAR(flat, 295.0 * 1e-3 * 2.56, 1e-3 * flat);
  setup.screen_y = Eigen::Vector3d(0.0, 0.5, std::sqrt(0.75));
  EXPECT_NEAR(source_blur(setup, 5.0), 2.0 * flat, 1e-2 * flat);
  EXPECT_EQ(source_blur(OpticalSetup{}, 5.0), 0.0);
}

TEST(SourcePoints, AMirrorsSourceIsSeenWithTheLensesYUp) {
  OpticalSetup setup;
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{{0.5, 0.0, -std::sqrt(0.75)}};
  // Light from higher up on the source comes down more: along −y.
  const OpticalSetup upper = lit_from(setup, {0.0, 0.01});
  const Eigen::Vector3d& way = std::get<ParallelLight>(upper.lamp).direction;
  EXPECT_NEAR(way.y(), -0.01, 1e-4);
  EXPECT_NEAR(way.norm(), 1.0, 1e-15);
}

}  // namespace
}  // namespace lensforge
