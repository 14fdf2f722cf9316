// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "cam/coupon/coupon.h"
#include "core/compute/scalar.h"

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

CouponState rough(double rms, double correlation) {
  CouponState state;
  state.roughness = {rms, correlation};
  return state;
}

/// S of a roughness in nm, written out.
double scattered(double rms, const CouponLight& light) {
  const double phase = 2.0 * std::numbers::pi * 1e-6 * rms * (light.ior - 1.0) / light.wavelength;
  return 1.0 - std::exp(-phase * phase);
}

/// Detectors that cover the hemisphere together take what the beam has lost.
TEST(CouponModel, HazeOfTheHemisphereIsWhatTheBeamLost) {
  const CouponLight light;
  for (const double correlation : {2.0, 3.0, 5.0}) {
    const CouponState state = rough(20.0, correlation);
    double sum = 0.0;
    constexpr double kStep = 0.01;  // Degrees
    for (double angle = 0.5 * kStep; angle < 90.0; angle += kStep) {
      const double ring = 2.0 * std::numbers::pi * std::sin(kDegree * angle) * kDegree * kStep;
      sum += state.haze_ratio({angle, ring}, light);
    }
    const double share = scattered(20.0, light);
    EXPECT_NEAR(sum, share / (1.0 - share), 1e-3 * share) << correlation;
  }
}

TEST(CouponModel, HazeFollowsTheRoughnesssPowerSpectrum) {
  const CouponLight light{633e-6, 1.5};
  const double share = scattered(8.0, light);
  for (const double angle : {0.5, 4.0, 20.0}) {
    const double wave = std::numbers::pi * 3e-3 / light.wavelength;  // π ℓ / λ
    const double s = std::sin(kDegree * angle);
    const double density = wave * wave / std::numbers::pi * std::exp(-wave * wave * s * s);
    const double expected = share / (1.0 - share) * density * std::cos(kDegree * angle) * 1e-4;
    EXPECT_NEAR(rough(8.0, 3.0).haze_ratio({angle, 1e-4}, light), expected, 1e-12 * expected);
  }
}

TEST(CouponModel, AWideDetectorReadsTheLightOfItsMiddle) {
  const CouponLight light;
  const double deviation = light.wavelength / (std::numbers::sqrt2 * std::numbers::pi * 5e-3);
  const double radius = 0.25 * deviation;
  const double extent = std::numbers::pi * radius * radius;
  const CouponState state = rough(10.0, 5.0);
  for (const double off : {0.5, 1.0, 1.5, 2.0, 2.5}) {
    // The mean over a disc of direction cosines.
    double sum = 0.0;
    int count = 0;
    constexpr int kHalf = 50;
    for (int i = -kHalf; i <= kHalf; ++i) {
      for (int j = -kHalf; j <= kHalf; ++j) {
        if (i * i + j * j > kHalf * kHalf) continue;
        const double s = std::hypot(off * deviation + radius * i / kHalf, radius * j / kHalf);
        const double angle = std::asin(s);
        sum += state.haze_ratio({angle / kDegree, extent / std::cos(angle)}, light);
        ++count;
      }
    }
    const double middle = std::asin(off * deviation);
    const double model = state.haze_ratio({middle / kDegree, extent / std::cos(middle)}, light);
    EXPECT_NEAR(sum / count, model, 0.035 * model) << off;
  }
}

/// A Gaussian random surface on a square grid with the autocorrelation rms² exp(−r² /
/// correlation²); all lengths in the same unit. White noise, averaged along both axes with exp(−2x²
/// / ℓ²).
Eigen::MatrixXd random_surface(int nodes, double step, double rms, double correlation,
                               std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd noise =
      Eigen::MatrixXd::NullaryExpr(nodes, nodes, [&] { return normal(random); });
  Eigen::MatrixXd average = Eigen::MatrixXd::NullaryExpr(nodes, nodes, [&](auto i, auto k) {
    const double x = step * static_cast<double>(i - k) / correlation;
    return std::exp(-2.0 * x * x);
  });
  average.rowwise().normalize();
  return rms * average * noise * average.transpose();
}

/// Light that random phase screens send in a direction, by Fraunhofer's integral of a Gaussian
/// beam: |∫ u exp(−i k s·x)|² / (λ² P) by direction cosines, over the share that is left of the
/// beam.
TEST(CouponModel, ARandomScreenScattersAsTheModelSays) {
  constexpr int kNodes = 256;
  constexpr double kStep = 0.8;         // µm
  constexpr double kWaist = 30.0;       // µm; the beam falls to exp(−r² / waist²).
  constexpr double kCorrelation = 4.0;  // µm
  constexpr double kRms = 15.0;         // nm
  constexpr int kScreens = 100;
  constexpr int kAround = 8;  // Directions at one angle; opposite ones have the same light.
  const CouponLight light;
  const double wavelength = 1e3 * light.wavelength;  // µm
  const Eigen::ArrayXd x =
      kStep * (Eigen::ArrayXd::LinSpaced(kNodes, 0.0, kNodes - 1.0) - 0.5 * (kNodes - 1));
  const Eigen::VectorXd beam = (-(x / kWaist).square()).exp();
  const double power = std::pow(kStep * beam.squaredNorm(), 2);
  const double left = 1.0 - scattered(kRms, light);
  const std::vector<double> angles{2.0, 3.0, 4.0};
  std::vector<double> sums(angles.size(), 0.0);
  std::mt19937 random(1);
  const auto wave = [&](double s) -> Eigen::VectorXcd {
    const std::complex<double> turn(0.0, -2.0 * std::numbers::pi * s / wavelength);
    return (turn * x.cast<std::complex<double>>()).exp() * beam.array();
  };
  for (int screen = 0; screen < kScreens; ++screen) {
    const Eigen::MatrixXcd light_behind =
        (std::complex<double>(0.0, light.phase() * 1e-6) *
         random_surface(kNodes, kStep, kRms, kCorrelation, random).cast<std::complex<double>>())
            .array()
            .exp();
    for (std::size_t a = 0; a < angles.size(); ++a) {
      const double s = std::sin(kDegree * angles[a]);
      for (int k = 0; k < kAround; ++k) {
        const double around = std::numbers::pi * k / kAround;
        const std::complex<double> field =
            (wave(s * std::cos(around)).transpose() * light_behind * wave(s * std::sin(around)))
                .value();
        sums[a] += std::norm(kStep * kStep * field) / (wavelength * wavelength * power);
      }
    }
  }
  for (std::size_t a = 0; a < angles.size(); ++a) {
    const double ratio =
        sums[a] / (kScreens * kAround) / left * std::cos(kDegree * angles[a]) * 1e-5;
    const double model = rough(kRms, kCorrelation).haze_ratio({angles[a], 1e-5}, light);
    // 800 speckles, each with a standard deviation of its mean: 3.5 %.
    EXPECT_NEAR(ratio, model, 0.12 * model) << angles[a];
    RecordProperty("off" + std::to_string(a), std::to_string(ratio / model));
  }
}

}  // namespace
}  // namespace lensforge
