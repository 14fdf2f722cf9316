// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/compute/scalar.h"

namespace lensforge::fuzz {

/// Numbers that are the same everywhere for the same seed; the standard library's distributions are
/// not.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  std::uint64_t next() { return engine_(); }
  /// 0 … count − 1. @pre count > 0.
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
  bool one_in(std::size_t count) { return below(count) == 0; }
  /// 0 … 1, 1 excluded.
  double unit() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }
  template <class T>
  const T& pick(const std::vector<T>& from) {
    return from[below(from.size())];
  }
  char byte() { return static_cast<char>(engine_() & 0xFFU); }
  std::string bytes(std::size_t count) {
    std::string text(count, '\0');
    for (char& c : text) c = byte();
    return text;
  }

 private:
  std::mt19937_64 engine_;
};

/// The seed of run `index` of a campaign (SplitMix64).
inline std::uint64_t seed_of_run(std::uint64_t seed, std::uint64_t index) {
  return mixed_bits(seed + (index + 1) * kGoldenGamma);
}

}  // namespace lensforge::fuzz
