// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_estimate.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

TEST(DesignEstimate, IsNearTheMeasuredDesigns) {
  // The 512² portrait as facets: 973 processor seconds and 1.8 GB; at 128²: 57 s.
  DesignOptions options;
  options.pixels = 512;
  const WorkEstimate large = estimate_design(512, 512, options, 1);
  EXPECT_GT(large.seconds, 973.0 / 2.0);
  EXPECT_LT(large.seconds, 973.0 * 2.0);
  EXPECT_GT(large.memory_bytes, 1.8e9 / 1.5);
  EXPECT_LT(large.memory_bytes, 1.8e9 * 1.5);
  options.pixels = 128;
  const WorkEstimate small = estimate_design(512, 512, options, 1);
  EXPECT_GT(small.seconds, 57.0 / 2.0);
  EXPECT_LT(small.seconds, 57.0 * 2.0);
}

TEST(DesignEstimate, ThreadsShareTheTimeAndEffortAddsToIt) {
  DesignOptions options;
  const double one = estimate_design(512, 512, options, 1).seconds;
  EXPECT_DOUBLE_EQ(estimate_design(512, 512, options, 2).seconds, 0.5 * one);
  options.rounds *= 2;
  EXPECT_GT(estimate_design(512, 512, options, 1).seconds, 1.5 * one);
}

}  // namespace
}  // namespace lensforge
