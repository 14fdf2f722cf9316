// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/lower_case.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

TEST(LowerCase, ChangesTheLettersOfAsciiAlone) {
  EXPECT_EQ(lower_case("A.STEP_Z@[`{09"), "a.step_z@[`{09");
  EXPECT_EQ(lower_case("M\xc3\x9cLLER"), "m\xc3\x9cller");
  EXPECT_EQ(lower_case(""), "");
}

}  // namespace
}  // namespace lensforge
