// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

// Small functions of single numbers.
namespace lensforge {

/// A number as an index of the standard library's containers. @pre value ≥ 0
constexpr std::size_t index_of(std::int64_t value) { return static_cast<std::size_t>(value); }

/// A function of one variable: value and slope.
template <class T>
struct ValueSlopeOf {
  T value{};
  T slope{};
};
using ValueSlope = ValueSlopeOf<double>;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// rad
inline constexpr double kDegree = std::numbers::pi / 180.0;

/// A float below a double, so that a box of floats contains the box of doubles.
inline float float_below(double value) {
  return std::nextafter(static_cast<float>(value), -std::numeric_limits<float>::infinity());
}

/// A float above a double.
inline float float_above(double value) {
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014): the
// k-th number of a stream is mixed_bits(seed + k·kGoldenGamma).

inline constexpr std::uint64_t kGoldenGamma = 0x9e3779b97f4a7c15ULL;

/// A bijection of 64-bit words after which every bit depends on every bit of `z`.
constexpr std::uint64_t mixed_bits(std::uint64_t z) {
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31U);
}

/// The upper 53 bits as a number in [0, 1).
constexpr double unit_share(std::uint64_t bits) {
  return static_cast<double>(bits >> 11U) * 0x1p-53;
}

}  // namespace lensforge
