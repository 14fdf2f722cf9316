// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <random>
#include <string>

#include "machine/gcode/gcode_reader.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;

GcodeBlock parse(std::string_view line) {
  GcodeText text;
  text.text = line;
  text.line = 7;
  return parse_gcode_block(text);
}

std::string refusal_of(std::string_view line) {
  try {
    parse(line);
  } catch (const GcodeError& error) {
    return error.what();
  }
  return {};
}

TEST(GcodeBlock, SplitsALineIntoWords) {
  const GcodeBlock block = parse("n12 g1X-1.5 y+.25Z3. (a ; b) F 500 ; rest (");
  EXPECT_EQ(block.number, 12);
  ASSERT_EQ(block.words().size(), 5U);
  EXPECT_EQ(block.words()[0].letter, 'G');
  EXPECT_EQ(block.words()[0].tenths, 10);
  EXPECT_EQ(block.value('X'), -1.5);
  EXPECT_EQ(block.value('Y'), 0.25);
  EXPECT_EQ(block.value('Z'), 3.0);
  EXPECT_EQ(block.value('F'), 500.0);
  EXPECT_FALSE(block.value('I'));
  EXPECT_EQ(block.line, 7);
}

TEST(GcodeBlock, KnowsEmptyAndPercentLines) {
  for (const std::string_view line : {"", "  \t", "(only a comment)", " ; only", "()(x);("}) {
    EXPECT_TRUE(parse(line).empty()) << line;
    EXPECT_FALSE(parse(line).percent) << line;
  }
  EXPECT_TRUE(parse("%").percent);
  EXPECT_TRUE(parse("\t% ").percent);
  EXPECT_THAT(refusal_of("% G21"), HasSubstr("must be alone"));
  EXPECT_THAT(refusal_of("G21 %"), HasSubstr("must be alone"));
}

TEST(GcodeBlock, ReadsNumbersAsTheyAreWritten) {
  std::mt19937_64 engine(7);
  for (int i = 0; i < 2000; ++i) {
    const auto whole = static_cast<std::int64_t>(engine() % 100'000'000);
    const auto part = static_cast<std::int64_t>(engine() % 1'000'000);
    std::string number = std::to_string(whole) + "." + std::to_string(part);
    if (engine() % 2 == 0) number = std::string("-").append(number);
    ASSERT_EQ(parse(std::string("X").append(number)).value('X'),
              std::strtod(number.c_str(), nullptr))
        << number;
  }
}

TEST(GcodeBlock, DecimalsOfGAndMAreKept) {
  EXPECT_EQ(parse("G91.1").words()[0].tenths, 911);
  EXPECT_EQ(parse("G01").words()[0].tenths, 10);
  EXPECT_EQ(parse("M03").words()[0].tenths, 30);
  EXPECT_THAT(refusal_of("G1.05"), HasSubstr("unknown word"));
  EXPECT_THAT(refusal_of("G-1"), HasSubstr("unknown word"));
  EXPECT_THAT(refusal_of("G1000"), HasSubstr("unknown word"));
}

TEST(GcodeBlock, RefusesWithLineAndReason) {
  const std::pair<const char*, const char*> cases[] = {
      {"G1 (open", "comment without its closing bracket"},
      {"G1 (a (b) c)", "comment inside a comment"},
      {"G1 a)", "a number is missing after A"},
      {"G1 )", "')' without an opening bracket"},
      {"X1e3", "'X1e': numbers with an exponent"},
      {"X1.5E-3", "numbers with an exponent"},
      {"X", "'X': a number is missing after X"},
      {"X Y1", "a number is missing after X"},
      {"X-", "'X-': a number is missing"},
      {"X.", "'X.': a number is missing"},
      {"X--1", "a number is missing"},
      {"X- 1", "a number is missing"},
      {"X1 0", "'0' where a letter is expected"},
      {"X1(c)0", "'0' where a letter is expected"},
      {"X1.2.3", "'.' where a letter is expected"},
      {"X123456789", "longer than 8 digits"},
      {"X1.2345678901234567", "16 in all"},
      {"X1 X2", "X is given twice"},
      {"N1 N2", "N is given twice"},
      {"N-1", "line numbers are integers, 0 or above"},
      {"N1.5", "line numbers are integers"},
      {"#1=3", "'#': parameters and expressions"},
      {"X[1+2]", "a number is missing after X"},
      {"/G1 X1", "block delete is not supported"},
      {"$H", "a controller's command"},
      {"G1 X1 *22", "'*' where a letter is expected"},
      {"12", "'1' where a letter is expected"},
  };
  for (const auto& [line, reason] : cases) {
    EXPECT_THAT(refusal_of(line), HasSubstr(reason)) << line;
    EXPECT_THAT(refusal_of(line), HasSubstr("line 7: ")) << line;
  }
  std::string many;
  for (int i = 0; i < 33; ++i) many += "G1";
  EXPECT_THAT(refusal_of(many), HasSubstr("more than 32 words"));
}

TEST(GcodeBlock, CompactTextKeepsWhatCounts) {
  EXPECT_EQ(compact_gcode("n12 g1 X 1.5 (n3) y2 ; z", true), "N12G1X1.5Y2");
  EXPECT_EQ(compact_gcode("n12 g1 X 1.5 (n3) y2 ; z", false), "G1X1.5Y2");
  EXPECT_EQ(compact_gcode("G1 N 12 X1", false), "G1X1");
  EXPECT_EQ(compact_gcode("%", true), "");
  EXPECT_EQ(compact_gcode("(x)", true), "");
}

}  // namespace
}  // namespace lensforge
