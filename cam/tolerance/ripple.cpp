// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/ripple.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

constexpr int kProfile = 96;    ///< Places of a period at which the scallop is known.
constexpr int kHarmonics = 32;  ///< Of it: without polish the last has 0.1 % of the first's height.
constexpr int kPhases = 64;     ///< Places at which the polished slope is told.

/// Nodes and weights of a normal distribution, exact to the ninth moment (Gauss and Hermite).
constexpr std::array<std::pair<double, double>, 5> kNormal{
    {{-2.8569700138728056, 0.01125741132772069},
     {-1.3556261799742659, 0.22207592200561264},
     {0.0, 0.53333333333333333},
     {1.3556261799742659, 0.22207592200561264},
     {2.8569700138728056, 0.01125741132772069}}};

/// Height of the scallop at the middles of kProfile equal parts of a period, mm.
std::array<double, kProfile> scallop(double pitch, double radius, double eccentricity) {
  std::array<double, kProfile> height{};
  for (int i = 0; i < kProfile; ++i) {
    const double t = std::abs((i + 0.5) / kProfile - 0.5) * pitch;
    const double out = std::clamp(t - eccentricity, 0.0, radius);
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

std::vector<WeightedValue> ripple_slopes(const Passes& passes, double radius, double eccentricity,
                                         const RipplePolish& polish) {
  auto height = scallop(passes.pitch, radius, eccentricity);
  if (passes.cross) height = crossed(height);
  const auto coefficients = harmonics(height);
  std::vector<WeightedValue> slopes;
  for (const auto& [node, weight] : kNormal) {
    const double sigma = std::max(0.0, polish.sigma * (1.0 + polish.within * node));
    for (int i = 0; i < kPhases; ++i) {
      double slope = 0.0;
      for (int k = 1; k <= kHarmonics; ++k) {
        const double wave = kTwoPi * k / passes.pitch;
        const double kept = std::exp(-0.5 * wave * wave * sigma * sigma);
        slope -= coefficients[static_cast<std::size_t>(k - 1)] * kept * wave *
                 std::sin(kTwoPi * k * (i + 0.5) / kPhases);
      }
      slopes.push_back({slope, weight / kPhases});
    }
  }
  return slopes;
}

}  // namespace lensforge
