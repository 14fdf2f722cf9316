// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/words.h"

#include <gtest/gtest.h>

namespace lensforge {
namespace {

TEST(LowerCase, ChangesTheLettersOfAsciiAlone) {
  EXPECT_EQ(lower_case("A.STEP_Z@[`{09"), "a.step_z@[`{09");
  EXPECT_EQ(lower_case("M\xc3\x9cLLER"), "m\xc3\x9cller");
  EXPECT_EQ(lower_case(""), "");
}

TEST(NearestWord, IsAtMostTwoEditsAway) {
  const std::set<std::string> known{"width", "focal", "pitch", "x"};
  EXPECT_EQ(nearest_word("widht", known), "width");
  EXPECT_EQ(nearest_word("pich", known), "pitch");
  EXPECT_EQ(nearest_word("width", known), "width");
  EXPECT_EQ(nearest_word("colour", known), "");
  EXPECT_EQ(nearest_word("y", known), "");  // Every letter would differ.
  EXPECT_EQ(nearest_word(std::string(100'000, 'w'), known), "");
}

}  // namespace
}  // namespace lensforge
