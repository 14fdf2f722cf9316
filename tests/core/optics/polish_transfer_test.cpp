// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/polish_transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <random>
#include <variant>
#include <vector>

#include "core/optics/optical_setup.h"

namespace lensforge {
namespace {

/// Largest error of the first `count` terms, from their kernels at even steps up to kFilmReach.
/// @param f  the function of kx² + ky². @param scale  of the error, by the same.
double error_of(const std::vector<LineTerm>& terms, std::size_t count,
                const std::function<double(double)>& f,
                const std::function<double(double)>& scale) {
  constexpr double kStep = 0.25;
  constexpr double kWaves = 0.1;
  constexpr int kMost = 42;  // Waves of 1.5 σ, of which nothing is left.
  std::vector<std::vector<double>> of_waves(count);
  for (std::size_t n = 0; n < count; ++n) {
    for (int i = 0; i <= kMost; ++i) {
      double sum = terms[n].kernel(0.0, 0) * kStep;
      for (double x = kStep; x <= kFilmReach; x += kStep) {
        sum += 2.0 * kStep * terms[n].kernel(x, 0) * std::cos(i * kWaves * x);
      }
      of_waves[n].push_back(sum);
    }
  }
  double worst = 0.0;
  for (std::size_t i = 0; i <= kMost; ++i) {
    for (std::size_t j = 0; j <= kMost; ++j) {
      const double square = kWaves * kWaves * static_cast<double>(i * i + j * j);
      double sum = 0.0;
      for (std::size_t n = 0; n < count; ++n) {
        sum += terms[n].sign * of_waves[n][i] * of_waves[n][j];
      }
      worst = std::max(worst, std::abs(sum - f(square)) * scale(square));
    }
  }
  return worst;
}

double film(double square) { return std::exp(-0.25 * square * square); }

TEST(PolishTransfer, IsAGaussianOrAFilmOverAFloor) {
  const PolishTransfer pads{0.03, 2, 0.1};
  const PolishTransfer flame{0.03, 4, 0.0};
  const double k = 40.0;
  EXPECT_DOUBLE_EQ(pads.at(k), 0.1 + 0.9 * std::exp(-0.5 * 0.03 * 0.03 * k * k));
  EXPECT_NEAR(flame.at(k), std::exp(-std::pow(0.03 * k / std::sqrt(2.0), 4)), 1e-15);
  EXPECT_DOUBLE_EQ(pads.at(0.0), 1.0);
  EXPECT_DOUBLE_EQ(pads.at(1e4), 0.1);
}

/// Both orders leave 1 / e of a wave of 2π σ / √2, with which σ is one length for both.
TEST(PolishTransfer, BothOrdersLeaveTheSameOfOneWave) {
  const double k = std::sqrt(2.0) / 0.03;
  EXPECT_NEAR(PolishTransfer({0.03, 2, 0.0}).at(k), std::exp(-1.0), 1e-15);
  EXPECT_NEAR(PolishTransfer({0.03, 4, 0.0}).at(k), std::exp(-1.0), 1e-15);
}

TEST(PolishTransfer, EachTermOfAFilmLowersTheErrorTenfold) {
  const auto one = [](double) { return 1.0; };
  EXPECT_LT(error_of(film_terms(), 3, film, one), 1.1e-3);
  EXPECT_LT(error_of(film_terms(), 4, film, one), 1.3e-4);
  EXPECT_LT(error_of(film_terms(), film_terms().size(), film, one), 2e-5);
}

TEST(PolishTransfer, TermsOverAGaussianMakeAFilmOfIt) {
  const auto gaussian = [](double square) { return std::exp(-0.5 * square); };
  const auto over = [&](double square) { return film(square) / gaussian(square); };
  const std::vector<LineTerm>& terms = film_over_gaussian_terms();
  EXPECT_LT(error_of(terms, terms.size(), over, gaussian), 3e-5);
}

TEST(PolishTransfer, TermsAreInterpolatedBetweenTheirValues) {
  for (double k = 0.0; k < 2.6; k += 0.0371) {
    double sum = 0.0;
    for (const LineTerm& term : film_terms()) sum += term.sign * term.at(k) * term.at(0.77);
    EXPECT_NEAR(sum, film(k * k + 0.77 * 0.77), 3e-5) << k;
  }
}

TEST(PolishTransfer, DerivativesOfKernelsAreThoseOfTheirValues) {
  constexpr double kStep = 1e-3;
  for (const LineTerm& term : film_terms()) {
    for (int n = 0; n < 3; ++n) {
      const double rise = term.kernel(1.3 + kStep, n) - term.kernel(1.3 - kStep, n);
      EXPECT_NEAR(term.kernel(1.3, n + 1), rise / (2.0 * kStep), 1e-5) << n;
    }
  }
}

constexpr double kGreen = 550e-6;  ///< mm

/// A lens of 20 mm before a wall of as many millimetres.
OpticalSetup lens_setup(int pixels = 40) {
  OpticalSetup setup;
  setup.lens_size = setup.image_size = {20.0, 20.0};
  setup.pixels = {pixels, pixels};
  setup.focal_length = 78.0;
  return setup;
}

TEST(Haze, OfALensIsThatOfItsPhase) {
  const Haze haze = haze_of({10.0, 5.0}, lens_setup(), 3.0, kGreen);
  const double phase = 2.0 * std::numbers::pi * 10e-6 * 0.49 / kGreen;
  EXPECT_NEAR(haze.share, 1.0 - std::exp(-phase * phase), 1e-12);
  EXPECT_NEAR(haze.share, 0.00313, 5e-6);
  // λ D / (√2 π ℓ) in pixels of half a millimetre.
  const double wide = kGreen * 75.0 / (std::sqrt(2.0) * std::numbers::pi * 5e-3) / 0.5;
  EXPECT_NEAR(haze.deviation.x(), wide, 1e-9);
  EXPECT_NEAR(haze.width(), 2.0 * std::sqrt(2.0 * std::log(2.0)) * wide, 1e-9);
  EXPECT_TRUE(haze_of({}, lens_setup(), 3.0, kGreen).none());
}

/// A mirror scatters 1 − exp(−(4π σ cos θ / λ)²), θ half of the angle by which it turns the light.
TEST(Haze, OfAMirrorIsThatOfItsAngle) {
  OpticalSetup setup = lens_setup();
  setup.body = MirrorBody{};
  const Eigen::Vector3d light = Eigen::Vector3d(0.3, 0.1, -1.0).normalized();
  setup.lamp = ParallelLight{light};
  setup.image_origin = {30.0, 0.0};
  const Eigen::Vector3d back =
      (setup.screen_centre() - Eigen::Vector3d(10.0, 10.0, 3.0)).normalized();
  const double cosine = std::cos(0.5 * std::acos(-light.dot(back)));
  const double phase = 4.0 * std::numbers::pi * 8e-6 * cosine / kGreen;
  EXPECT_NEAR(haze_of({8.0, 5.0}, setup, 3.0, kGreen).share, 1.0 - std::exp(-phase * phase), 1e-9);
}

/// The share grows with the square of the roughness, as long as it is small.
TEST(Haze, OfARougherSurfaceIsThatOfItsRoughness) {
  const Haze haze = haze_of({10.0, 5.0}, lens_setup(), 3.0, kGreen);
  EXPECT_NEAR(haze.times(2.0).share, haze_of({20.0, 5.0}, lens_setup(), 3.0, kGreen).share, 1e-14);
  EXPECT_EQ(haze.times(2.0).roughness.rms, 20.0);
  EXPECT_TRUE(Haze{}.times(2.0).none());
}

/// Light of a pixel at (dx, dy) pixels from one that scatters: the sum over points of both.
double moved(int dx, int dy, const Eigen::Vector2d& deviation) {
  constexpr int kPoints = 12;
  const auto along = [](int d, double sigma) {
    double sum = 0.0;
    for (int i = 0; i < kPoints; ++i) {
      for (int j = 0; j < kPoints; ++j) {
        const double t = d + static_cast<double>(i - j) / kPoints;
        sum += std::exp(-0.5 * t * t / (sigma * sigma));
      }
    }
    return sum / (kPoints * kPoints * sigma * std::sqrt(2.0 * std::numbers::pi));
  };
  return along(dx, deviation.x()) * along(dy, deviation.y());
}

/// The haze of a picture, from every pixel to every pixel.
std::vector<double> slow_haze(const Haze& haze, const std::vector<double>& flux,
                              const Eigen::Vector2i& pixels) {
  std::vector<double> picture(flux.size());
  for (int to = 0; to < pixels.prod(); ++to) {
    double sum = 0.0;
    for (int from = 0; from < pixels.prod(); ++from) {
      const double light = flux[static_cast<std::size_t>(from)];
      if (light == 0.0) continue;
      sum += light * moved(to % pixels.x() - from % pixels.x(), to / pixels.x() - from / pixels.x(),
                           haze.deviation);
    }
    const auto k = static_cast<std::size_t>(to);
    picture[k] = (1.0 - haze.share) * flux[k] + haze.share * sum;
  }
  return picture;
}

/// One lit pixel, one that is lit in the corner, and a picture that is dark on the left.
TEST(Haze, OfAPictureIsTheSumOverItsPixels) {
  const Eigen::Vector2i pixels(24, 18);
  const auto count = static_cast<std::size_t>(pixels.prod());
  std::vector<std::vector<double>> pictures(3, std::vector<double>(count, 0.0));
  pictures[0][9 * 24 + 11] = 1.0;
  pictures[1][0] = 1.0;
  for (std::size_t k = 0; k < count; ++k) pictures[2][k] = k % 24 < 12 ? 0.0 : 1.0 / 216.0;
  for (const Eigen::Vector2d& deviation :
       {Eigen::Vector2d(0.7, 1.4), Eigen::Vector2d(2.5, 2.0), Eigen::Vector2d(14.0, 11.0)}) {
    const Haze haze{0.02, deviation, {25.0, 5.0}};
    for (const std::vector<double>& flux : pictures) {
      const std::vector<double> fast = hazed(haze, flux, pixels, Executor::cpu(2));
      const std::vector<double> slow = slow_haze(haze, flux, pixels);
      for (std::size_t k = 0; k < count; ++k) {
        const double scattered = slow[k] - (1.0 - haze.share) * flux[k];
        // Where the Gaussian ends, nothing stands for 2e-9 of it.
        EXPECT_NEAR(fast[k], slow[k], 0.02 * scattered + 1e-10) << k;
      }
      EXPECT_EQ(fast, hazed(haze, flux, pixels, Executor::serial()));
    }
  }
}

/// In the dark, away from the border of a wide picture, the light is S / 2 erfc(x / √2 σ).
TEST(Haze, BesideABorderFallsAsTheErrorFunction) {
  const Eigen::Vector2i pixels(120, 1);
  std::vector<double> flux(120, 0.0);
  std::fill(flux.begin() + 60, flux.end(), 1.0);
  const Haze haze{0.0031, {4.0, 1e-3}, {10.0, 5.0}};
  const std::vector<double> picture = hazed(haze, flux, pixels, Executor::serial());
  for (int x = 52; x < 60; ++x) {
    const double away = 59.5 - x;
    // Half of a pixel's height stays in the row only for a narrow haze: here all but 1e-3.
    const double expected = 0.5 * haze.share * std::erfc(away / (4.0 * std::numbers::sqrt2));
    EXPECT_NEAR(picture[static_cast<std::size_t>(x)], expected, 0.02 * expected) << x;
  }
}

TEST(Haze, LosesWhatLeavesThePictureAndNothingElse) {
  const Eigen::Vector2i pixels(64, 64);
  std::vector<double> flux(64 * 64, 0.0);
  flux[32 * 64 + 32] = 1.0;
  const auto inside = [&](double deviation) {
    double sum = 0.0;
    for (const double light :
         hazed({0.1, {deviation, deviation}, {}}, flux, pixels, Executor::serial())) {
      EXPECT_GE(light, 0.0);
      sum += light;
    }
    return sum;
  };
  for (const double deviation : {1e-3, 0.2, 1.0, 4.0}) EXPECT_NEAR(inside(deviation), 1.0, 1e-9);
  const double side = std::erf(32.0 / (40.0 * std::numbers::sqrt2));
  EXPECT_NEAR(inside(40.0), 0.9 + 0.1 * side * side, 1e-4);
  for (const double far : {1e4, 1e9}) EXPECT_NEAR(inside(far), 0.9, 1e-5) << far;
}

TEST(Haze, NoneLeavesThePictureAsItIs) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any;
  std::vector<double> flux(35);
  for (double& value : flux) value = any(random);
  EXPECT_EQ(hazed({}, flux, {7, 5}, Executor::serial()), flux);
}

}  // namespace
}  // namespace lensforge
