// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/design_profile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"

namespace lensforge::bench {
namespace {

constexpr const char* kTable =
    "stage,level,mae,seconds\n"
    "transport,0,0,2\n"
    "transport,0,0,3\n"
    "render,0,0.4,5\n"
    "render,0,0.1,6\n"
    "render,0,0.2,8\n";

TEST(DesignProfile, CountsStepsAndSecondsByStage) {
  const DesignProfile profile = design_profile(kTable, 0.5);
  ASSERT_EQ(profile.phases.size(), 2U);
  EXPECT_EQ(profile.phases[0].stage, "transport");
  EXPECT_EQ(profile.phases[0].steps, 2);
  EXPECT_DOUBLE_EQ(profile.phases[0].seconds, 1.5);
  EXPECT_EQ(profile.phases[1].steps, 3);
  EXPECT_DOUBLE_EQ(profile.phases[1].seconds, 2.5);
  EXPECT_DOUBLE_EQ(profile.seconds, 4.0);
}

TEST(DesignProfile, KeepsTheLeastErrorUntilThen) {
  const DesignProfile profile = design_profile(kTable, 1.0);
  EXPECT_TRUE(std::isnan(error_after(profile, 4.0)));
  EXPECT_DOUBLE_EQ(error_after(profile, 5.5), 0.4);
  EXPECT_DOUBLE_EQ(error_after(profile, 7.0), 0.1);
  EXPECT_DOUBLE_EQ(error_after(profile, 100.0), 0.1);
}

TEST(DesignProfile, RefusesOtherTables) {
  EXPECT_THROW(design_profile("stage,seconds\n", 1.0), InputError);
  EXPECT_THROW(design_profile("stage,mae,seconds\nrender,0.1\n", 1.0), InputError);
}

}  // namespace
}  // namespace lensforge::bench
