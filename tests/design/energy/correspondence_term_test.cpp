// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "design/energy/picture_terms.h"
#include "design/finite_difference.h"
#include "design/random_input.h"

namespace lensforge {
namespace {

using testing::Random;

constexpr double kPixels = 480.0;

ImageTriangle unpack(const Eigen::VectorXd& x) {
  return {x.segment<2>(0), x.segment<2>(2), x.segment<2>(4), x[6]};
}

Eigen::VectorXd pack(const ImageTriangle& t) {
  Eigen::VectorXd x(7);
  x << t.p0, t.p1, t.p2, t.flux;
  return x;
}

TEST(CorrespondenceTerm, IsTheSquaredDistanceOfTheCentroidAndTheSquaredExcessOfFlux) {
  // Centroid (3, 4), wanted at (1, 5); of 1/100 of the light 1/120 is wanted, of 480 pixels 4.8
  // and 4.
  ImageTriangle bar;
  const CorrespondenceValues v =
      correspondence_term({{1.0, 2.0}, {5.0, 4.0}, {3.0, 6.0}, 0.01}, {1.0, 5.0}, 1.0 / 120.0,
                          kPixels, {.align = 2.0, .flux = 3.0}, bar);
  EXPECT_DOUBLE_EQ(v.align, 4.0 + 1.0);
  EXPECT_NEAR(v.flux, 0.64, 1e-13);
}

TEST(CorrespondenceTerm, VanishesWhereTheLightIsAsWanted) {
  ImageTriangle bar;
  const CorrespondenceValues v =
      correspondence_term({{1.0, 2.0}, {5.0, 4.0}, {3.0, 6.0}, 0.01}, {3.0, 4.0}, 0.01, kPixels,
                          {.align = 2.0, .flux = 3.0}, bar);
  EXPECT_EQ(v.align, 0.0);
  EXPECT_EQ(v.flux, 0.0);
  EXPECT_TRUE(pack(bar).isZero());
}

TEST(CorrespondenceTerm, ShapeOfATriangleDoesNotMatter) {
  ImageTriangle ignored;
  const auto value = [&](const ImageTriangle& t) {
    return correspondence_term(t, {7.0, 7.0}, 0.02, kPixels, {.align = 1.0, .flux = 1.0}, ignored);
  };
  const CorrespondenceValues flat = value({{1.0, 2.0}, {5.0, 4.0}, {3.0, 6.0}, 0.01});
  const CorrespondenceValues turned = value({{8.0, -1.0}, {-2.0, 11.0}, {3.0, 2.0}, 0.01});
  EXPECT_DOUBLE_EQ(flat.align, turned.align);
  EXPECT_DOUBLE_EQ(flat.flux, turned.flux);
}

TEST(CorrespondenceTerm, AdjointAddsAndEqualsCentralDifferences) {
  Random random(1);
  double worst = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d centroid = 20.0 * random.vector2();
    const double flux = random.between(0.0, 0.01);
    const double align_weight = random.magnitude(1e-2, 1e2);
    const double flux_weight = random.magnitude(1e-2, 1e2);
    Eigen::VectorXd x(7);
    for (double& value : x) value = random.between(-20.0, 20.0);
    x[6] = random.between(0.0, 0.01);
    const auto f = [&](const Eigen::VectorXd& at) {
      ImageTriangle ignored;
      const CorrespondenceValues v = correspondence_term(unpack(at), centroid, flux, kPixels,
                                                         {.align = 0.0, .flux = 0.0}, ignored);
      return align_weight * v.align + flux_weight * v.flux;
    };
    const Eigen::VectorXd before = Eigen::VectorXd::LinSpaced(7, -1.0, 1.0);
    ImageTriangle bar = unpack(before);
    correspondence_term(unpack(x), centroid, flux, kPixels,
                        {.align = align_weight, .flux = flux_weight}, bar);
    const Eigen::VectorXd computed = pack(bar) - before;
    for (const double step : {1e-3, 5e-4}) {
      const Eigen::VectorXd expected = testing::numeric_gradient(f, x, step);
      // Corners and flux have scales of their own.
      worst = std::max({worst, testing::gradient_error(computed.head(6), expected.head(6)),
                        std::fabs(computed[6] / expected[6] - 1.0)});
    }
  }
  RecordProperty("log10_worst", std::to_string(std::log10(worst)));
  EXPECT_LT(worst, 1e-7);
}

}  // namespace
}  // namespace lensforge
