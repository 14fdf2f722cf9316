// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/random_draw.h"

#include <cmath>
#include <numbers>

#include "core/compute/split_mix.h"

namespace lensforge {

RandomDraw::RandomDraw(std::uint64_t seed, std::uint64_t part, std::uint64_t cause)
    : state_(mixed_bits(mixed_bits(mixed_bits(seed + kGoldenGamma) + part + kGoldenGamma) + cause +
                        kGoldenGamma)) {}

std::uint64_t RandomDraw::next() {
  state_ += kGoldenGamma;
  return mixed_bits(state_);
}

double RandomDraw::share() {
  constexpr double kSteps = 0x1p-53;
  return (static_cast<double>(next() >> 11U) + 0.5) * kSteps;
}

double RandomDraw::normal() {
  const double length = std::sqrt(-2.0 * std::log(share()));
  return length * std::cos(2.0 * std::numbers::pi * share());
}

}  // namespace lensforge
