// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>

#include "core/compute/split_mix.h"

namespace lensforge {

/// An arc's words in a digest; all zero for a straight motion.
struct DigestArc {
  std::int64_t direction = 0;            ///< 1 + twice the normal axis's number, + 1 clockwise.
  std::array<std::int64_t, 3> centre{};  ///< Units; zero along the normal axis and with R words.

  friend bool operator==(const DigestArc&, const DigestArc&) = default;
};

/// Numbers that two paths share if, and but for a chance of 2^-64 only if, they have the same
/// motions at feed in the same order, to the last decimal: what is written and what is read back
/// are compared by it.
class PathDigest {
 public:
  using Units = std::array<std::int64_t, 3>;

  /// One motion at feed; coordinates in units of the last decimal, the feed in 1e-6 mm/min.
  void add(const Units& start, const Units& end, std::int64_t feed, const DigestArc& arc) {
    for (const std::int64_t value : start) mix(value);
    for (const std::int64_t value : end) mix(value);
    mix(feed);
    mix(arc.direction);
    if (arc.direction != 0) {
      for (const std::int64_t value : arc.centre) mix(value);
    }
    ++motions_;
  }

  [[nodiscard]] std::int64_t motions() const { return motions_; }

  friend bool operator==(const PathDigest&, const PathDigest&) = default;

 private:
  /// One round of SplitMix64 over the state and the value.
  void mix(std::int64_t value) {
    state_ = mixed_bits(state_ + static_cast<std::uint64_t>(value) + kGoldenGamma);
  }

  std::uint64_t state_ = 0;
  std::int64_t motions_ = 0;
};

}  // namespace lensforge
