// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/number_text.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

TEST(TrimmedDecimal, LosesZerosBehindThePointAlone) {
  EXPECT_EQ(trimmed_decimal(0.3, 4), "0.3");
  EXPECT_EQ(trimmed_decimal(-2.25, 2), "-2.25");
  EXPECT_EQ(trimmed_decimal(120.0, 3), "120");
  EXPECT_EQ(trimmed_decimal(23000.0, 0), "23000");
}

TEST(TrimmedDecimal, RoundsToTheDecimalsAndHasNoNegativeZero) {
  EXPECT_EQ(trimmed_decimal(0.12996, 4), "0.13");
  EXPECT_EQ(trimmed_decimal(-0.00001, 4), "0");
  EXPECT_EQ(trimmed_decimal(-0.4, 0), "0");
}

}  // namespace
}  // namespace lensforge
