// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/polish_filter.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

// Notation: θ = k · spacing, the phase from one node to the next; a wave of n nodes has 2π / n.

namespace lensforge {
namespace {

/// Up to here (waves of three nodes) the response is that of the polish; above it falls to zero,
/// because a box's own response is close to zero there and nothing can be restored.
constexpr double kBand = 2.0;
/// Minimum number of phases for fitting the response, and the number per weight.
constexpr std::int64_t kPhases = 96;
constexpr std::int64_t kPhasesPerWeight = 8;

constexpr double kBeyond = 0.1;  ///< Weight of the phases above kBand.
constexpr double kGentle = 0.1;  ///< Long waves weigh more: 1 / (kGentle + θ²).

double box_response(const LinePolish& polish, double theta) {
  const double step = theta * polish.box / polish.spacing / static_cast<double>(polish.samples);
  if (step < 1e-6) return 1.0;
  const auto count = static_cast<double>(polish.samples);
  return std::sin(0.5 * count * step) / (count * std::sin(0.5 * step));
}

double response(const LinePolish& polish, double theta) {
  const double in = std::min(theta, kBand);
  const double t = polish.sigma / polish.spacing * in;
  const double wanted = std::exp(-0.5 * t * t) / box_response(polish, in);
  if (theta <= kBand) return wanted;
  const double rest = (std::numbers::pi - theta) / (std::numbers::pi - kBand);
  return wanted * rest * rest;
}

double weight(double theta) { return (theta <= kBand ? 1.0 : kBeyond) / (kGentle + theta * theta); }

/// Solves for the weights of pairs first … reach: `basis(k, θ)` is the contribution of pair k to
/// the response, `target(θ)` the wanted response.
template <class Basis, class Target>
Eigen::VectorXd fit(std::int64_t first, std::int64_t reach, const Basis& basis,
                    const Target& target) {
  const std::int64_t phases = std::max(kPhases, kPhasesPerWeight * reach);
  Eigen::MatrixXd rows(phases, reach - first + 1);
  Eigen::VectorXd wanted(phases);
  for (std::int64_t i = 0; i < phases; ++i) {
    const double theta =
        std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(phases);
    const double w = weight(theta);
    for (std::int64_t k = first; k <= reach; ++k) {
      rows(i, k - first) = w * basis(static_cast<double>(k), theta);
    }
    wanted(i) = w * target(theta);
  }
  return rows.colPivHouseholderQr().solve(wanted);
}

}  // namespace

std::int64_t line_filter_reach(double sigma, double spacing) {
  constexpr double kSigmas = 4.2;
  return static_cast<std::int64_t>(std::ceil(kSigmas * std::max(sigma / spacing, 0.5))) + 3;
}

/// The innermost significant pair is set so that the sum is 1, or the slope of a straight line its
/// own; the others are free. For a node itself that is pair 0, twice the node, and pair 1.
LineFilter line_filter(const LinePolish& polish, std::int64_t shift, std::int64_t reach) {
  const auto size = static_cast<std::size_t>(reach + 1);
  LineFilter filter{shift, std::vector<double>(size), std::vector<double>(size)};
  const double half = 0.5 * static_cast<double>(shift);
  const std::int64_t inner = 1 - shift;  // Of slopes.
  const double away = static_cast<double>(inner) + half;
  const Eigen::VectorXd average = fit(
      1, reach,
      [&](double k, double theta) {
        return 2.0 * (std::cos((k + half) * theta) - std::cos(half * theta));
      },
      [&](double theta) { return response(polish, theta) - std::cos(half * theta); });
  const Eigen::VectorXd slope = fit(
      inner + 1, reach,
      [&](double k, double theta) {
        const double straight = (k + half) / away * std::sin(away * theta);
        return 2.0 * (std::sin((k + half) * theta) - straight) / theta;
      },
      [&](double theta) {
        return response(polish, theta) - std::sin(away * theta) / (away * theta);
      });
  filter.average[0] = 0.5 - average.sum();
  double straight = 0.5;
  for (std::int64_t k = 1; k <= reach; ++k) {
    const auto n = static_cast<std::size_t>(k);
    filter.average[n] = average(k - 1);
    if (k == inner) continue;
    const double weight = slope(k - inner - 1);
    filter.slope[n] = weight / polish.spacing;
    straight -= (static_cast<double>(k) + half) * weight;
  }
  filter.slope[static_cast<std::size_t>(inner)] = straight / (away * polish.spacing);
  return filter;
}

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

constexpr int kProfile = 96;    ///< Sampled places of a scallop's period.
constexpr int kHarmonics = 32;  ///< Used; without polish the last has 0.1 % of the first's height.
/// Stored slopes per period; linear interpolation between them is exact to 1e-4 of a sine.
constexpr std::size_t kSlopePlaces = 256;

/// Height of the scallop at the middles of kProfile equal parts of a period, mm.
std::array<double, kProfile> scallop(double pitch, double radius) {
  std::array<double, kProfile> height{};
  for (int i = 0; i < kProfile; ++i) {
    const double out = std::min(std::abs((i + 0.5) / kProfile - 0.5) * pitch, radius);
    height[static_cast<std::size_t>(i)] = radius - std::sqrt((radius - out) * (radius + out));
  }
  return height;
}

/// Mean of what a crossing second raster leaves of a scallop.
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
  for (std::size_t i = 0; i < kSlopePlaces; ++i) {
    double slope = 0.0;
    for (int k = 1; k <= kHarmonics; ++k) {
      const double wave = kTwoPi * k / passes.pitch;
      const double kept = std::exp(-0.5 * wave * wave * sigma * sigma);
      slope -= coefficients[static_cast<std::size_t>(k - 1)] * kept * wave *
               std::sin(kTwoPi * k * static_cast<double>(i) / kSlopePlaces);
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
  const double phase = (periods - std::floor(periods)) * static_cast<double>(kSlopePlaces);
  const std::size_t i = std::min(static_cast<std::size_t>(phase), kSlopePlaces - 1);
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
