// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace lensforge {

/// Random numbers that follow from what they are for: one stream for a seed, a part and a cause,
/// whatever was drawn for others. SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom
/// Number Generators", 2014); the same on every machine but for the last bit of a logarithm.
class RandomDraw {
 public:
  RandomDraw(std::uint64_t seed, std::uint64_t part, std::uint64_t cause);

  /// Even in 0 … 1, neither end included.
  double share();
  /// Even in −1 … 1.
  double even() { return 2.0 * share() - 1.0; }
  /// Normal with mean 0 and standard deviation 1 (Box and Muller).
  double normal();

 private:
  std::uint64_t next();

  std::uint64_t state_;
};

}  // namespace lensforge
