// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/energy/picture_terms.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

constexpr double kWide = 30.0;
constexpr double kHigh = 20.0;

double value_of(const ImageTriangle& t) {
  ImageTriangle ignored;
  return boundary_term(t, kWide, kHigh, 1.0, ignored);
}

TEST(BoundaryTerm, IsZeroInsideThePictureAndOnItsBorder) {
  ImageTriangle bar;
  EXPECT_EQ(boundary_term({{0.0, 0.0}, {30.0, 3.0}, {7.0, 20.0}, 1.0}, kWide, kHigh, 2.0, bar),
            0.0);
  EXPECT_TRUE(bar.p0.isZero() && bar.p1.isZero() && bar.p2.isZero());
}

TEST(BoundaryTerm, IsTheSquaredDistanceFromThePicture) {
  EXPECT_DOUBLE_EQ(value_of({{-3.0, 5.0}, {7.0, 24.0}, {33.0, -4.0}, 1.0}), 9.0 + 16.0 + 25.0);
}

TEST(BoundaryTerm, AdjointEqualsCentralDifferences) {
  testing::Random random(1);
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd x(6);
    for (double& value : x) value = random.between(-15.0, 45.0);
    x[0] = -random.between(1.0, 5.0);
    const auto unpack = [](const Eigen::VectorXd& at) {
      return ImageTriangle{at.segment<2>(0), at.segment<2>(2), at.segment<2>(4), 1.0};
    };
    const auto f = [&](const Eigen::VectorXd& at) { return 0.7 * value_of(unpack(at)); };
    ImageTriangle bar;
    boundary_term(unpack(x), kWide, kHigh, 0.7, bar);
    Eigen::VectorXd computed(6);
    computed << bar.p0, bar.p1, bar.p2;
    EXPECT_LT(testing::plateau_error(computed, f, x, 1e-4), 1e-7);
  }
}

}  // namespace
}  // namespace lensforge
