// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge::units_test {
namespace {

TEST(Units, ANumberWithoutUnitIsMillimetres) {
  EXPECT_DOUBLE_EQ(parse_length_mm("100", "--width"), 100.0);
  EXPECT_DOUBLE_EQ(parse_length_mm("1e2", "--width"), 100.0);
  EXPECT_DOUBLE_EQ(parse_length_mm("-2.5", "--offset"), -2.5);
}

TEST(Units, EveryUnitIsTurnedIntoMillimetres) {
  EXPECT_DOUBLE_EQ(parse_length_mm("100mm", "w"), 100.0);
  EXPECT_DOUBLE_EQ(parse_length_mm("10cm", "w"), 100.0);
  EXPECT_DOUBLE_EQ(parse_length_mm("0.1m", "w"), 100.0);
  EXPECT_DOUBLE_EQ(parse_length_mm("4in", "w"), 101.6);
  EXPECT_DOUBLE_EQ(parse_length_mm("250um", "w"), 0.25);
  EXPECT_DOUBLE_EQ(parse_length_mm("250\u00b5m", "w"), 0.25);
}

TEST(Units, SpacesAroundNumberAndUnitAreAllowed) {
  EXPECT_DOUBLE_EQ(parse_length_mm(" 10 cm ", "w"), 100.0);
}

TEST(Units, RefusesWhatIsNoLengthAndNamesOptionAndValue) {
  for (const char* text :
       {"", " ", "mm", "10 feet", "ten", "10mm5", "nan", "inf", "1e400", "1e308m", "--5", "1,5"}) {
    try {
      parse_length_mm(text, "--width");
      ADD_FAILURE() << text << " was accepted";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::StartsWith(std::string("--width: '") + text + "'"));
    }
  }
}

}  // namespace
}  // namespace lensforge::units_test
