// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/ripple.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

constexpr int kProfile = 96;    ///< Places of a period at which the scallop is known.
constexpr int kHarmonics = 32;  ///< Of it: without polish the last has 0.1 % of the first's height.
/// Parts of a period at which the slope is kept; between them it is linear, to 1e-4 of a sine.
constexpr std::size_t kPhases = 256;

/// Height of the scallop at the middles of kProfile equal parts of a period, mm.
std::array<double, kProfile> scallop(double pitch, double radius) {
  std::array<double, kProfile> height{};
  for (int i = 0; i < kProfile; ++i) {
    const double out = std::min(std::abs((i + 0.5) / kProfile - 0.5) * pitch, radius);
    height[static_cast<std::size_t>(i)] = radius - std::sqrt((radius - out) * (radius + out));
  }
  return height;
}

/// What a second raster across leaves of a scallop, on average.
std::array<double, kProfile> crossed(const std::array<double, kProfile>& height) {
  std::array<double, kProfile> lower{};
  for (std::size_t i = 0; i < kProfile; ++i) {
    for (const double other : height) lower[i] += std::min(height[i], other) / kProfile;
  }
  return lower;
}

/// Cosine coefficients 1 … kHarmonics of a profile that is even about its middle.
std::array<double, kHarmonics> harmonics(const std::array<double, kProfile>& height) {
  std::array<double, kHarmonics> coefficients{};
  for (int k = 1; k <= kHarmonics; ++k) {
    double sum = 0.0;
    for (int i = 0; i < kProfile; ++i) {
      const double t = (i + 0.5) / kProfile - 0.5;
      sum += height[static_cast<std::size_t>(i)] * std::cos(kTwoPi * k * t);
    }
    coefficients[static_cast<std::size_t>(k - 1)] = 2.0 * sum / kProfile;
  }
  return coefficients;
}

}  // namespace

Ripple::Ripple(const Passes& passes, double radius, double sigma)
    : pitch_(passes.pitch), radius_(radius), sigma_(sigma), sign_(passes.cast ? -1.0 : 1.0) {
  auto height = scallop(passes.pitch, radius);
  if (passes.cross) height = crossed(height);
  const auto coefficients = harmonics(height);
  for (std::size_t i = 0; i < kPhases; ++i) {
    double slope = 0.0;
    for (int k = 1; k <= kHarmonics; ++k) {
      const double wave = kTwoPi * k / passes.pitch;
      const double kept = std::exp(-0.5 * wave * wave * sigma * sigma);
      slope -= coefficients[static_cast<std::size_t>(k - 1)] * kept * wave *
               std::sin(kTwoPi * k * static_cast<double>(i) / kPhases);
    }
    slope_.push_back(slope);
    largest_ = std::max(largest_, std::abs(slope));
  }
  slope_.push_back(slope_.front());
}

double Ripple::slope(double place, const Eigen::Vector2d& surface, int across) const {
  const double stretch = std::sqrt(1.0 + surface.squaredNorm());
  const double lowest = sign_ * radius_ * surface[across] / stretch;
  const double periods = (place - lowest) / pitch_;
  const double phase = (periods - std::floor(periods)) * static_cast<double>(kPhases);
  const std::size_t i = std::min(static_cast<std::size_t>(phase), kPhases - 1);
  const double t = phase - static_cast<double>(i);
  const double bend = (1.0 + surface[across] * surface[across]) * stretch;
  return sign_ * bend * (slope_[i] + t * (slope_[i + 1] - slope_[i]));
}

double Ripple::seen_by_disc(double radius) const {
  constexpr double kSmall = 1e-4;  // Below, the series' x²/8 is 1e-9.
  const double x = kTwoPi * radius / pitch_;
  return x < kSmall ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, x) / x;
}

double Ripple::kept(double factor) const {
  const double t = kTwoPi / pitch_ * sigma_;
  return std::exp(-0.5 * t * t * (factor * factor - 1.0));
}

}  // namespace lensforge
