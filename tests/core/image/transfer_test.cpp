// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/transfer.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

TEST(Transfer, BlackAndWhiteStay) {
  EXPECT_EQ(encode(0.0), 0.0);
  EXPECT_DOUBLE_EQ(encode(1.0), 1.0);
  EXPECT_DOUBLE_EQ(decode(1.0), 1.0);
}

TEST(Transfer, MiddleGreyIsTheStandardsFigure) {
  // IEC 61966-2-1: code 128 of 255 is 21.586 % light.
  EXPECT_NEAR(decode(128.0 / 255.0), 0.215861, 1e-6);
}

TEST(Transfer, DecodeUndoesEncode) {
  for (int i = 0; i <= 2000; ++i) {
    const double linear = i / 1000.0;
    EXPECT_NEAR(decode(encode(linear)), linear, 1e-7);
  }
}

TEST(Transfer, SlopeAgreesWithCentralDifferences) {
  for (const double linear : {1e-4, 0.003, 0.0032, 0.01, 0.3, 1.0, 1.7}) {
    for (const double step : {1e-6 * linear, 5e-7 * linear}) {
      const double slope = (encode(linear + step) - encode(linear - step)) / (2.0 * step);
      EXPECT_NEAR(encode_slope(linear), slope, 1e-8 * slope + 1e-9);
    }
  }
}

TEST(Transfer, IsOddBelowZeroInsideTheToe) { EXPECT_EQ(encode(-0.002), -encode(0.002)); }

}  // namespace
}  // namespace lensforge
