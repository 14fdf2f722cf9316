// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cam/tolerance/part_model.h"

namespace lensforge {
namespace {

constexpr double kPi = std::numbers::pi;
const Eigen::Vector2d kFlat(0.0, 0.0);

TEST(Ripple, OfAPolishedRasterIsTheScallopsFirstHarmonic) {
  const Passes passes{0.06, 0.2};
  const double sigma = 0.03;
  const Ripple ripple(passes, 0.2, {sigma});
  const double height = passes.pitch * passes.pitch / (8.0 * 0.2);
  const double wave = 2.0 * kPi / passes.pitch;
  const double slope =
      4.0 * height / (kPi * kPi) * std::exp(-0.5 * wave * wave * sigma * sigma) * wave;
  EXPECT_NEAR(ripple.largest(), slope, 0.02 * slope);
  EXPECT_NEAR(ripple.slope(0.25 * passes.pitch, kFlat, 1), slope, 0.02 * slope);
  EXPECT_NEAR(ripple.slope(0.0, kFlat, 1), 0.0, 1e-9);
  EXPECT_NEAR(ripple.slope(7.75 * passes.pitch, kFlat, 1), -slope, 0.02 * slope);
}

TEST(Ripple, OfAFilmAndOfAFloorIsTheirTransfer) {
  const Passes passes{0.06, 0.2};
  const double wave = 2.0 * kPi / passes.pitch;
  const double first = Ripple(passes, 0.2, {0.02}).largest() / PolishTransfer({0.02}).at(wave);
  const PolishTransfer film{0.015, 4};
  EXPECT_NEAR(Ripple(passes, 0.2, film).largest(), first * film.at(wave), 0.02 * first);
  const PolishTransfer more{1.1 * 0.015, 4};
  EXPECT_NEAR(Ripple(passes, 0.2, film).kept(1.1), more.at(wave) / film.at(wave), 1e-9);
  EXPECT_NEAR(Ripple(passes, 0.2, {0.3, 2, 0.1}).slope(0.02, kFlat, 1),
              0.1 * Ripple(passes, 0.2, {0.0}).slope(0.02, kFlat, 1), 1e-9);
}

TEST(Ripple, OfAnUnpolishedRasterIsTheBall) {
  const Passes passes{0.06, 0.2};
  const Ripple ripple(passes, 0.2, {0.0});
  for (const double y : {-0.02, -0.01, 0.005, 0.02}) {
    EXPECT_NEAR(ripple.slope(y, kFlat, 1), y / std::sqrt(0.04 - y * y), 0.005) << y;
  }
}

TEST(Ripple, LiesWhereTheBallTouchesASlope) {
  const Passes passes{0.06, 0.2};
  const Ripple ripple(passes, 0.2, {0.03});
  const Eigen::Vector2d slope(0.05, 0.1);
  const double lowest = 0.2 * 0.1 / std::sqrt(1.0 + slope.squaredNorm());
  EXPECT_NEAR(ripple.slope(lowest, slope, 1), 0.0, 1e-9);
  EXPECT_GT(ripple.slope(lowest + 0.01, slope, 1), 0.0);
}

TEST(Ripple, OfAMouldIsTurnedOver) {
  Passes passes{0.06, 0.2};
  const Ripple lens(passes, 0.2, {0.03});
  passes.cast = true;
  const Ripple cast(passes, 0.2, {0.03});
  EXPECT_DOUBLE_EQ(cast.slope(0.01, kFlat, 1), -lens.slope(0.01, kFlat, 1));
}

TEST(Ripple, IsWeakerWhereMoreIsPolished) {
  const Passes passes{0.06, 0.2};
  const Ripple ripple(passes, 0.2, {0.03});
  EXPECT_NEAR(ripple.kept(1.2), Ripple(passes, 0.2, {0.036}).largest() / ripple.largest(), 0.01);
  EXPECT_DOUBLE_EQ(ripple.kept(1.0), 1.0);
}

}  // namespace
}  // namespace lensforge
