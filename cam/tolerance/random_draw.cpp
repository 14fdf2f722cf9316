// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/random_draw.h"

#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15U;

std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31U);
}

}  // namespace

RandomDraw::RandomDraw(std::uint64_t seed, std::uint64_t part, std::uint64_t cause)
    : state_(mixed(mixed(mixed(seed + kGolden) + part + kGolden) + cause + kGolden)) {}

std::uint64_t RandomDraw::next() {
  state_ += kGolden;
  return mixed(state_);
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
