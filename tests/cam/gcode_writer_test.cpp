// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/gcode_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <locale>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "core/decimal_text.h"
#include "core/error.h"

namespace lensforge {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

GcodeOptions small_tool() {
  GcodeOptions options;
  options.spindle_rpm = 23000;
  options.spin_up = 2.5;
  options.feed = 500;
  options.plunge = 150;
  options.safe_z = 5;
  return options;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The lines that `cut` makes after the head of the program and before its end.
template <class Cut>
std::vector<std::string> body(const GcodeOptions& options, const Cut& cut) {
  std::ostringstream out;
  GcodeWriter writer(out, options);
  writer.begin({}, 0);
  const auto head = static_cast<std::ptrdiff_t>(writer.lines());
  cut(writer);
  const auto tail = static_cast<std::ptrdiff_t>(writer.lines());
  writer.end();
  const auto lines = lines_of(out.str());
  return {lines.begin() + head, lines.begin() + tail};
}

TEST(GcodeWriter, BeginsAndEndsSafely) {
  std::ostringstream out;
  GcodeWriter writer(out, small_tool());
  writer.begin({"job: test"}, 0);
  writer.plunge_to({1.0, 2.0, -0.5});
  writer.cut_to({2.0, 2.0, -0.5});
  writer.end();
  EXPECT_THAT(lines_of(out.str()),
              ElementsAre("(job: test)", "G21 G90 G17 G94", "G40 G49 G80", "G54", "T1 M6",
                          "G0 Z5.0000", "S23000 M3", "G4 P2.5", "X1.0000 Y2.0000",
                          "G1 Z-0.5000 F150", "X2.0000 F500", "G0 Z5.0000", "M5", "M2"));
  EXPECT_EQ(writer.lines(), 14);
}

TEST(GcodeWriter, GrblHasNoToolChange) {
  std::ostringstream out;
  GcodeOptions options = small_tool();
  options.post = Post::kGrbl;
  GcodeWriter writer(out, options);
  writer.begin({}, 0);
  writer.end();
  EXPECT_EQ(out.str().find('T'), std::string::npos);
  EXPECT_EQ(out.str().find("M6"), std::string::npos);
}

TEST(GcodeWriter, LimitsCornerBlendingWhereTheControllerKnowsIt) {
  for (const Post post : {Post::kLinuxcnc, Post::kGrbl}) {
    std::ostringstream out;
    GcodeOptions options = small_tool();
    options.post = post;
    options.blend_tolerance = 0.00004;
    GcodeWriter writer(out, options);
    writer.begin({}, 0);
    writer.end();
    EXPECT_EQ(out.str().find("\nG64 P0.00004\n") != std::string::npos, post == Post::kLinuxcnc);
  }
}

TEST(GcodeWriter, ModalWordsAreNotRepeated) {
  const auto lines = body(small_tool(), [](GcodeWriter& writer) {
    writer.plunge_to({0.0, 0.0, -1.0});
    writer.cut_to({1.0, 0.0, -1.0});
    writer.cut_to({2.0, 0.0, -1.1});
    writer.cut_to({2.0, 0.0, -1.1});
    writer.cut_to({2.00001, 0.0, -1.1});
    writer.cut_to({2.0, 0.06, -1.1});
  });
  EXPECT_THAT(lines, ElementsAre("X0.0000 Y0.0000", "G1 Z-1.0000 F150", "X1.0000 F500",
                                 "X2.0000 Z-1.1000", "Y0.0600"));
}

TEST(GcodeWriter, FeedIsStatedOnTheFirstMoveAfterEveryRapid) {
  GcodeOptions options = small_tool();
  options.plunge = options.feed;
  const auto lines = body(options, [](GcodeWriter& writer) {
    for (const double x : {1.0, 3.0}) {
      writer.plunge_to({x, 0.0, -1.0});
      writer.cut_to({x + 1.0, 0.0, -1.0});
    }
  });
  EXPECT_THAT(lines, ElementsAre("X1.0000 Y0.0000", "G1 Z-1.0000 F500", "X2.0000", "G0 Z5.0000",
                                 "X3.0000", "G1 Z-1.0000 F500", "X4.0000"));
}

TEST(GcodeWriter, NumbersAreExactWithoutExponentOrNegativeZero) {
  GcodeOptions options = small_tool();
  for (const int decimals : {4, 5, 6}) {
    options.decimals = decimals;
    std::mt19937_64 engine(static_cast<unsigned>(decimals));
    std::uniform_real_distribution<double> anywhere(-200.0, 200.0);
    std::vector<double> values{0.0, -0.0, -1e-9, 1e-9, -0.00004, 12345.6789, -99.99999};
    for (int i = 0; i < 500; ++i) values.push_back(anywhere(engine));
    for (const double value : values) {
      const auto lines = body(options, [&](GcodeWriter& writer) {
        writer.plunge_to({7777.0, 7777.0, 0.0});
        writer.cut_to({value, 7777.0, 0.0});
      });
      const std::string word = lines.back().substr(0, lines.back().find(' '));
      ASSERT_EQ(word.find_first_not_of("X-.0123456789"), std::string::npos) << word;
      ASSERT_EQ(word.size() - word.find('.') - 1, static_cast<std::size_t>(decimals)) << word;
      const double read = std::stod(word.substr(1));
      ASSERT_LE(std::abs(read - value), 0.500001 * std::pow(10.0, -decimals));
      ASSERT_FALSE(read == 0.0 && word.find('-') != std::string::npos) << word;
    }
  }
}

/// A locale with a decimal comma and grouped digits.
class CommaPunctuation : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(GcodeWriter, DoesNotDependOnTheLocale) {
  const auto write = [] {
    std::ostringstream out;
    GcodeWriter writer(out, small_tool());
    writer.begin({"diameter " + decimal_text(0.4, 3)}, 0);
    writer.plunge_to({1234.5, 0.0, -1.25});
    writer.end();
    return out.str();
  };
  const std::string plain = write();
  const std::locale old = std::locale::global(std::locale(std::locale(), new CommaPunctuation));
  EXPECT_EQ(write(), plain);
  std::locale::global(old);
  EXPECT_THAT(plain, HasSubstr("X1234.5000"));
}

TEST(GcodeWriter, CommentsCannotBreakTheProgram) {
  std::ostringstream out;
  GcodeWriter writer(out, small_tool());
  writer.begin({"job: a (b) c", "what?! ~x\nM3", "caf\xc3\xa9", std::string(200, 'x')}, 0);
  writer.end();
  const auto lines = lines_of(out.str());
  EXPECT_EQ(lines[0], "(job: a _b_ c)");
  EXPECT_EQ(lines[1], "(what__ _x_M3)");
  EXPECT_EQ(lines[2], "(caf__)");
  for (const std::string& line : lines) EXPECT_LE(line.size(), 80U);
}

TEST(GcodeWriter, ReservedCommentsAreFilledInPlace) {
  std::ostringstream out;
  GcodeWriter writer(out, small_tool());
  writer.begin({"first"}, 2);
  writer.plunge_to({0.0, 0.0, -1.0});
  writer.end();
  writer.fill_in({"depth 1 mm", std::string(300, 'y')});
  const auto lines = lines_of(out.str());
  EXPECT_EQ(static_cast<std::int64_t>(lines.size()), writer.lines());
  EXPECT_THAT(lines[1], ::testing::StartsWith("(depth 1 mm "));
  EXPECT_EQ(lines[1].size(), 80U);
  EXPECT_EQ(lines[2], "(" + std::string(78, 'y') + ")");
  EXPECT_EQ(lines[3], "G21 G90 G17 G94");
  EXPECT_EQ(lines.back(), "M2");
}

TEST(GcodeWriter, PostsAreKnownByName) {
  EXPECT_EQ(parse_post("grbl"), Post::kGrbl);
  EXPECT_EQ(parse_post("linuxcnc"), Post::kLinuxcnc);
  EXPECT_THROW(parse_post("fanuc"), InputError);
}

TEST(DecimalText, HasNoNegativeZeroAndNoExponent) {
  EXPECT_EQ(decimal_text(-0.00001, 4), "0.0000");
  EXPECT_EQ(decimal_text(-1.5, 0), "-2");
  EXPECT_EQ(decimal_text(1e-12, 3), "0.000");
  EXPECT_EQ(decimal_text(1e21, 1), "1000000000000000000000.0");
  EXPECT_EQ(decimal_text(std::numeric_limits<double>::infinity(), 1), "inf");
}

}  // namespace
}  // namespace lensforge
