// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_model.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace lensforge {
namespace {

/// Height of a ball's lower side over its lowest point, at a distance from the axis.
double ball_height(double radius, double distance) {
  const double rest = std::max(0.0, radius * radius - distance * distance);
  return distance * distance / (radius + std::sqrt(rest));
}

/// cos(2πk/N) for k = 0 … N − 1.
template <std::size_t N>
const std::array<double, N>& cosines() {
  static const std::array<double, N> table = [] {
    std::array<double, N> values{};
    for (std::size_t k = 0; k < N; ++k) {
      values[k] =
          std::cos(2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(N));
    }
    return values;
  }();
  return table;
}

}  // namespace

double groove_width(double radius, double depth) {
  if (depth <= 0.0) return 0.0;
  return depth >= radius ? 2.0 * radius : 2.0 * std::sqrt(depth * (2.0 * radius - depth));
}

double scallop_height(double radius, double pitch) {
  return pitch >= 2.0 * radius ? radius : ball_height(radius, 0.5 * pitch);
}

PolishedScallop::PolishedScallop(double radius, double pitch, double sigma) {
  const auto& cosine = cosines<kNodes>();
  std::array<double, kNodes> raw{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    const double share = static_cast<double>(std::min(j, kNodes - j)) / kNodes;
    raw[j] = ball_height(radius, std::min(share * pitch, radius));
  }
  const double ratio = std::numbers::pi * sigma / pitch;
  for (std::size_t n = 0; n < kHarmonics; ++n) {
    const double left = std::exp(-2.0 * std::pow(static_cast<double>(n) * ratio, 2));
    if (left < 1e-18) break;  // Below the last bit of the first harmonic.
    double sum = 0.0;
    for (std::size_t j = 0; j < kNodes; ++j) sum += raw[j] * cosine[n * j % kNodes];
    const double sides = n == 0 || n == kNodes / 2 ? 1.0 : 2.0;
    waves_[n] = sides / kNodes * sum * left;
    count_ = n + 1;
  }
}

double PolishedScallop::at(std::size_t node) const {
  const auto& cosine = cosines<kNodes>();
  double z = 0.0;
  for (std::size_t n = 0; n < count_; ++n) z += waves_[n] * cosine[n * node % kNodes];
  return z;
}

double PolishedScallop::height() const { return at(kNodes / 2) - at(0); }

double PolishedScallop::order_ratio(double phase) const {
  const auto& cosine = cosines<kNodes>();
  std::complex<double> zeroth = 0.0;
  std::complex<double> first = 0.0;
  for (std::size_t j = 0; j < kNodes; ++j) {
    const std::complex<double> light = std::polar(1.0, phase * at(j));
    zeroth += light;
    first += light * cosine[j];
  }
  return std::norm(first) / std::norm(zeroth);
}

CouponState CouponState::of(const Workshop& workshop) {
  const FinishProcess& finish = workshop.process.finish;
  return {workshop.polish.sigma, workshop.tool(finish.tool).radius(), finish.pitch_error, 0.0};
}

double CouponState::mark_distance(double programmed) const {
  return (1.0 + pitch_error) * programmed;
}

double CouponState::groove_width(double depth) const {
  return lensforge::groove_width(radius, depth + groove_offset);
}

double CouponState::scallop_before(double pitch) const {
  return scallop_height(radius, (1.0 + pitch_error) * pitch);
}

double CouponState::scallop_after(double pitch) const {
  return PolishedScallop(radius, (1.0 + pitch_error) * pitch, sigma).height();
}

double CouponState::order_ratio(double pitch, const CouponLight& light) const {
  return PolishedScallop(radius, (1.0 + pitch_error) * pitch, sigma).order_ratio(light.phase());
}

}  // namespace lensforge
