// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/polish_transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

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

}  // namespace
}  // namespace lensforge
