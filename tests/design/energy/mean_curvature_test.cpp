// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "design/energy/smoothness.h"

namespace lensforge {
namespace {

TEST(MeanCurvature, IsSquaredHalfTraceTimesArea) {
  const ValueSlope term = mean_curvature_term({0.2, 0.4, 7.0}, 5.0);
  EXPECT_DOUBLE_EQ(term.value, 0.09 * 5.0);
  EXPECT_DOUBLE_EQ(term.slope, 0.09);
}

}  // namespace
}  // namespace lensforge
