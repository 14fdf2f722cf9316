// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "core/text/words.h"

namespace lensforge {
namespace {

TEST(PrintableLine, OrdinaryTextStaysAsItIs) {
  EXPECT_EQ(printable_line("lens.json: 'größe' 80 µm → 0.1"), "lens.json: 'größe' 80 µm → 0.1");
  EXPECT_EQ(printable_line(""), "");
}

TEST(PrintableLine, ControlCharactersDoNotReachTheTerminal) {
  EXPECT_EQ(printable_line("a\x1b[31mb\x07"), "a?[31mb?");
  EXPECT_EQ(printable_line("a\xc2\x9b"
                           "2Jb\x7f"),
            "a?2Jb?");
  EXPECT_EQ(printable_line("one\r\ntwo\tthree\n"), "one  two three");
  EXPECT_EQ(printable_line(std::string_view("a\0b", 3)), "a?b");
  EXPECT_EQ(printable_line("a\xe2\x80\xae"
                           "b"),
            "a?b")
      << "right-to-left override";
}

TEST(PrintableLine, WhatIsNoUtf8IsMarked) {
  EXPECT_EQ(printable_line("a\xff"
                           "b"),
            "a?b");
  EXPECT_EQ(printable_line("\xc0\xaf"), "??") << "overlong";
  EXPECT_EQ(printable_line("\xed\xa0\x80"), "???") << "surrogate";
  EXPECT_EQ(printable_line("\xf4\x90\x80\x80"), "????") << "above U+10FFFF";
  EXPECT_EQ(printable_line("\xe2\x82"), "??") << "cut short";
}

TEST(PrintableLine, ALongTextIsCutInItsMiddle) {
  const std::string line = printable_line("begin" + std::string(3'000'000, 'x') + "end", 40);
  EXPECT_EQ(line.size(), 40U);
  EXPECT_TRUE(line.starts_with("begin"));
  EXPECT_TRUE(line.ends_with("end"));
  EXPECT_NE(line.find(" ... "), std::string::npos);
}

TEST(PrintableLine, ACutNeverSplitsACharacter) {
  std::string text;
  for (int i = 0; i < 100; ++i) text += "µ→x";
  for (std::size_t most = 16; most < 60; ++most) {
    const std::string line = printable_line(text, most);
    EXPECT_LE(line.size(), most);
    EXPECT_EQ(line.find('?'), std::string::npos) << most;
    EXPECT_EQ(printable_line(line), line) << most;
  }
}

TEST(PrintableLines, LinesStayLines) {
  EXPECT_EQ(printable_lines("a\x1b[2J\n  b\n\nc"), "a?[2J\n  b\n\nc");
  EXPECT_EQ(printable_lines("a\n"), "a\n");
  EXPECT_EQ(printable_lines(""), "");
  const std::string wide(5000, 'x');
  EXPECT_EQ(printable_lines(wide + "\r\n"), wide + " \n");
}

TEST(PrintableLine, OfRandomBytesOnlyPrintableOnesAreLeft) {
  std::mt19937 random(1);
  for (int run = 0; run < 2000; ++run) {
    std::string text(random() % 80, '\0');
    for (char& c : text) c = static_cast<char>(random());
    const std::string line = printable_line(text);
    EXPECT_EQ(printable_line(line), line);
    for (const char c : line) EXPECT_GE(static_cast<unsigned char>(c), 0x20);
  }
}

}  // namespace
}  // namespace lensforge
