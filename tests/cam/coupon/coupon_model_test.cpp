// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "cam/coupon/coupon_readings.h"

namespace lensforge {
namespace {

constexpr double kRadius = 0.2;

TEST(CouponModel, AGrooveIsAsWideAsTheChordOfTheBall) {
  // 3-4-5: a ball of 5 that goes in by 1 cuts a chord of 6.
  EXPECT_DOUBLE_EQ(groove_width(5.0, 1.0), 6.0);
  EXPECT_EQ(groove_width(5.0, 5.0), 10.0);
  EXPECT_EQ(groove_width(5.0, 7.0), 10.0);
  EXPECT_EQ(groove_width(5.0, -0.1), 0.0);
}

TEST(CouponModel, AScallopIsAsHighAsTheBallRises) {
  EXPECT_DOUBLE_EQ(scallop_height(5.0, 6.0), 1.0);
  EXPECT_NEAR(scallop_height(kRadius, 0.06), 0.06 * 0.06 / (8.0 * kRadius), 2e-5);
  EXPECT_EQ(scallop_height(kRadius, 1.0), kRadius);
}

/// Height of the averaged profile at one place, by a sum over 12 σ in steps of a thousandth of σ.
double averaged(double pitch, double sigma, double place) {
  double sum = 0.0;
  double weights = 0.0;
  for (int k = -6000; k <= 6000; ++k) {
    const double t = 1e-3 * k;
    const double off = std::remainder(place + sigma * t, pitch);
    const double weight = std::exp(-0.5 * t * t);
    sum += weight * (kRadius - std::sqrt(kRadius * kRadius - off * off));
    weights += weight;
  }
  return sum / weights;
}

TEST(CouponModel, PolishedScallopsAreTheAverageOfArcs) {
  for (const double pitch : {0.05, 0.09, 0.18}) {
    for (const double share : {0.02, 0.1, 0.2, 0.35, 0.5}) {
      const double sigma = share * pitch;
      const double slow = averaged(pitch, sigma, 0.5 * pitch) - averaged(pitch, sigma, 0.0);
      EXPECT_NEAR(PolishedScallop(kRadius, pitch, {sigma}).height(), slow, 3e-4 * slow)
          << pitch << " " << share;
    }
  }
}

TEST(CouponModel, ScallopsThatAreNotPolishedKeepTheirHeight) {
  EXPECT_NEAR(PolishedScallop(kRadius, 0.1, {0.0}).height(), scallop_height(kRadius, 0.1), 1e-15);
}

TEST(CouponModel, LittleIsLeftOfNarrowPasses) {
  // Of the first harmonic of a parabola, 4h/π², polish leaves exp(−2π²σ²/p²).
  const double pitch = 0.06;
  const double sigma = 0.03;
  const double parabola = pitch * pitch / (8.0 * kRadius);
  const double first = 4.0 * parabola / std::pow(std::numbers::pi, 2) *
                       std::exp(-2.0 * std::pow(std::numbers::pi * sigma / pitch, 2));
  EXPECT_NEAR(PolishedScallop(kRadius, pitch, {sigma}).height(), 2.0 * first, 0.02 * first);
}

TEST(CouponModel, OrdersOfAWaveAreBesselFunctions) {
  // At σ = 0.4 p the second harmonic is 3e-9 of the first: a cosine, whose orders are J_k(φ a).
  const double pitch = 0.09;
  const PolishedScallop wave(kRadius, pitch, {0.4 * pitch});
  for (const double delay : {0.1, 0.8, 1.5, 3.5}) {
    const double phase = delay / (0.5 * wave.height());
    const double bessel = std::pow(std::cyl_bessel_j(1, delay) / std::cyl_bessel_j(0, delay), 2);
    EXPECT_NEAR(wave.order_ratio(phase), bessel, 1e-6 * bessel) << delay;
  }
}

}  // namespace
}  // namespace lensforge
