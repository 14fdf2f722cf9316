// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <streambuf>
#include <string>
#include <vector>

#include "core/error.h"

namespace lensforge::gcode_reader_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& program) {
  std::istringstream in(program);
  GcodeReader reader(in);
  std::vector<std::string> lines;
  while (const auto text = reader.next()) lines.emplace_back(text->text);
  return lines;
}

std::string joined(const std::vector<std::string>& lines, const std::string& end) {
  std::string text = lines.front();
  for (std::size_t i = 1; i < lines.size(); ++i) text.append(end).append(lines[i]);
  return text;
}

std::string refusal_of(const std::string& program) {
  try {
    lines_of(program);
  } catch (const GcodeError& error) {
    return error.what();
  }
  return {};
}

TEST(GcodeReader, ReadsEveryKindOfLineEnd) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    EXPECT_THAT(lines_of(joined({"G21", "G90", ""}, end)), ElementsAre("G21", "G90"));
    EXPECT_THAT(lines_of(joined({"G21", "", "G90"}, end)), ElementsAre("G21", "", "G90"));
  }
  EXPECT_THAT(lines_of("a\rb\nc\r\nd"), ElementsAre("a", "b", "c", "d"));
  EXPECT_THAT(lines_of("a\n\rb"), ElementsAre("a", "", "b"));
  EXPECT_TRUE(lines_of("").empty());
}

TEST(GcodeReader, LineEndsMayStraddleItsBuffer) {
  for (std::size_t pad = 65530; pad < 65540; ++pad) {
    std::string program;
    while (program.size() + 100 < pad) program += std::string(99, 'x') + "\n";
    program += std::string(pad - program.size(), 'y') + "\r\nlast";
    const auto lines = lines_of(program);
    ASSERT_EQ(lines.back(), "last");
    ASSERT_EQ(lines[lines.size() - 2].front(), 'y');
  }
}

TEST(GcodeReader, TellsWhereLinesStand) {
  std::istringstream in("G21\r\n\nX1\rX2");
  GcodeReader reader(in);
  std::vector<std::int64_t> begins;
  std::vector<std::int64_t> ends;
  std::vector<std::int64_t> numbers;
  while (const auto text = reader.next()) {
    begins.push_back(text->offset);
    ends.push_back(text->next_offset);
    numbers.push_back(text->line);
  }
  EXPECT_THAT(begins, ElementsAre(0, 5, 6, 9));
  EXPECT_THAT(ends, ElementsAre(5, 6, 9, 11));
  EXPECT_THAT(numbers, ElementsAre(1, 2, 3, 4));
}

TEST(GcodeReader, GoesOnWhereItIsTold) {
  std::istringstream in("G21\nG90\nX1\nX2\n");
  GcodeReader reader(in);
  while (reader.next()) {
  }
  reader.seek(8, 3);
  const auto text = reader.next();
  ASSERT_TRUE(text);
  EXPECT_EQ(text->text, "X1");
  EXPECT_EQ(text->line, 3);
  EXPECT_EQ(text->offset, 8);
  EXPECT_EQ(reader.next()->line, 4);
}

TEST(GcodeReader, RefusesEveryByteThatIsNoText) {
  for (int byte = 0; byte < 256; ++byte) {
    const char c = static_cast<char>(byte);
    if (c == '\n' || c == '\r') continue;
    const bool text =
        c == '\t' || (byte >= 0x20 && byte < 0x7F && c != '?' && c != '!' && c != '~');
    for (const std::string& before : {std::string("G21\nG1 X"), std::string("G21\n(x)")}) {
      const std::string refusal = refusal_of(before + c + "1\n");
      EXPECT_EQ(refusal.empty(), text) << byte;
      if (!text) {
        EXPECT_THAT(refusal, HasSubstr("line 2: byte 0x")) << byte;
      }
    }
  }
}

TEST(GcodeReader, TakesAnyByteInAComment) {
  for (int byte = 0; byte < 256; ++byte) {
    const char c = static_cast<char>(byte);
    if (c == '\n' || c == '\r' || c == '(' || c == ')') continue;
    const bool text =
        c == '\t' || (byte >= 0x20 && byte < 0x7F && c != '?' && c != '!' && c != '~');
    for (const std::string& comment :
         {std::string("(x") + c + ") X1", std::string("X1 ; (") + c, std::string("X1 ;)") + c}) {
      std::istringstream in("G21\n" + comment + "\nX2\n");
      GcodeReader reader(in);
      EXPECT_FALSE(reader.next()->unsafe_comment);
      const auto read = reader.next();
      EXPECT_EQ(read->text, comment);
      EXPECT_EQ(read->unsafe_comment, !text) << byte;
      EXPECT_EQ(compact_gcode(read->text, false), "X1") << byte;
      EXPECT_FALSE(reader.next()->unsafe_comment);
    }
  }
}

TEST(GcodeReader, NamesTheRuleThatAByteBreaks) {
  EXPECT_THAT(refusal_of(std::string("G1 \0X1", 6)),
              HasSubstr("line 1: byte 0x00 in column 4: NUL"));
  EXPECT_THAT(refusal_of("(what)?"), HasSubstr("byte 0x3F in column 7: the controller treats"));
  EXPECT_THAT(refusal_of("\xEF\xBB\xBFG21\n"), HasSubstr("UTF-8 byte order mark"));
  EXPECT_THAT(refusal_of("G21\n()\xC3\xA9"), HasSubstr("line 2: byte 0xC3 in column 3"));
  EXPECT_THAT(refusal_of("G1\x18"), HasSubstr("byte 0x18"));
  EXPECT_THAT(refusal_of("G1\x7F"), HasSubstr("control byte"));
}

/// A stream that never ends and never breaks the line; counts what was taken from it.
class EndlessLine : public std::streambuf {
 public:
  [[nodiscard]] std::int64_t taken() const { return taken_; }

 protected:
  std::streamsize xsgetn(char* to, std::streamsize count) override {
    std::fill(to, to + count, 'X');
    taken_ += count;
    return count;
  }
  int_type underflow() override { return 'X'; }

 private:
  std::int64_t taken_ = 0;
};

TEST(GcodeReader, RefusesAnEndlessLineWithoutReadingIt) {
  EndlessLine endless;
  std::istream in(&endless);
  GcodeReader reader(in);
  EXPECT_THROW(reader.next(), GcodeError);
  EXPECT_LE(endless.taken(), 1 << 16);
}

TEST(GcodeReader, HoldsTheLineLimitToTheCharacter) {
  const std::string longest(GcodeReader::kLongestLine, 'x');
  EXPECT_THAT(lines_of(longest + "\r\n" + longest), ElementsAre(longest, longest));
  EXPECT_EQ(refusal_of("G21\n" + longest + "x"), "line 2: longer than 256 characters");
}

}  // namespace
}  // namespace lensforge::gcode_reader_test
