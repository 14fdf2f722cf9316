// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/error.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

TEST(ErrorDeathTest, AFalseCheckPrintsConditionAndValuesAndAborts) {
  const int count = 3;
  EXPECT_DEATH(LF_CHECK(count == 4, "count is " + std::to_string(count)),
               "error_test.cpp:[0-9]+: count == 4 is false \\(count is 3\\)");
}

TEST(Error, ATrueCheckDoesNothing) { LF_CHECK(1 + 1 == 2, "arithmetic"); }

}  // namespace
}  // namespace lensforge
