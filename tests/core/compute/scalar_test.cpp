// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/scalar.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

TEST(SplitMix, GivesTheNumbersOfTheReferenceGenerator) {
  constexpr std::uint64_t kSeed = 1234567;
  EXPECT_EQ(mixed_bits(kSeed + kGoldenGamma), 6457827717110365317ULL);
  EXPECT_EQ(mixed_bits(kSeed + 2 * kGoldenGamma), 3203168211198807973ULL);
  EXPECT_EQ(mixed_bits(kSeed + 3 * kGoldenGamma), 9817491932198370423ULL);
}

TEST(SplitMix, SharesReachFromZeroToBelowOne) {
  EXPECT_EQ(unit_share(0), 0.0);
  EXPECT_EQ(unit_share(1ULL << 63U), 0.5);
  EXPECT_EQ(unit_share(~0ULL), 1.0 - 0x1p-53);
}

}  // namespace
}  // namespace lensforge
