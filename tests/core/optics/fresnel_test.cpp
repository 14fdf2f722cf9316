// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/optics/refraction.h"

namespace lensforge {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TEST(Fresnel, AcrylicLetsThroughWhatFormulasByAnglesSay) {
  for (double degrees = 1.0; degrees < 42.0; degrees += 1.0) {
    const double i = degrees * kDegree;
    const double t = std::asin(1.49 * std::sin(i));
    const double across = std::sin(i - t) / std::sin(i + t);
    const double along = std::tan(i - t) / std::tan(i + t);
    const double expected = 1.0 - 0.5 * (across * across + along * along);
    EXPECT_NEAR(transmittance(std::cos(i), 1.49).value, expected, 1e-12) << degrees;
  }
  EXPECT_NEAR(transmittance(1.0, 1.49).value, 1.0 - std::pow(0.49 / 2.49, 2), 1e-15);
}

TEST(Fresnel, LightAlongThePolarisingAngleLosesOnePolarisationAlone) {
  const double i = std::atan(1.0 / 1.5);
  const double t = 0.5 * std::numbers::pi - i;
  const double across = std::sin(i - t);
  EXPECT_NEAR(transmittance(std::cos(i), 1.5).value, 1.0 - 0.5 * across * across, 1e-12);
}

TEST(Fresnel, NothingPassesBeyondTheCriticalAngle) {
  const double critical = std::sqrt(1.0 - 1.0 / (1.49 * 1.49));
  EXPECT_EQ(transmittance(critical - 1e-9, 1.49).value, 0.0);
  EXPECT_LT(transmittance(critical + 1e-9, 1.49).value, 1e-3);
  EXPECT_EQ(transmittance(-0.9, 1.49).value, 0.0);
}

TEST(Fresnel, SlopeEqualsCentralDifferences) {
  for (double c = 0.76; c < 0.999; c += 0.01) {
    const double h = 1e-6;
    const double expected =
        (transmittance(c + h, 1.49).value - transmittance(c - h, 1.49).value) / (2.0 * h);
    EXPECT_NEAR(transmittance(c, 1.49).slope, expected, 1e-8 * (1.0 + std::abs(expected)));
  }
}

TEST(Fresnel, TwoReflectionsOfAcrylicAreAThousandthAndAHalf) {
  EXPECT_NEAR(ghost_share(1.49), std::pow(0.49 / 2.49, 4), 1e-15);
}

}  // namespace
}  // namespace lensforge
