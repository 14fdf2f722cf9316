// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cstdio>
#include <vector>

#include "core/error.h"
#include "core/temp_folder.h"
#include "export/solid/solid_files.h"

namespace lensforge::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// A line of 80 columns without its end.
std::string line(std::string content, char section, int sequence) {
  content.resize(72, ' ');
  char end[16];
  std::snprintf(end, sizeof end, "%c%7d", section, sequence);
  return content + end;
}

std::string fields(const std::vector<int>& values) {
  std::string text;
  for (const int value : values) {
    char field[16];
    std::snprintf(field, sizeof field, "%8d", value);
    text += field;
  }
  return text;
}

std::string counts(int start, int global, int directory, int parameters) {
  char text[64];
  std::snprintf(text, sizeof text, "S%7dG%7dD%7dP%7d", start, global, directory, parameters);
  return text;
}

std::string parameters(const std::string& data, int entry) {
  char end[16];
  std::snprintf(end, sizeof end, "%8d", entry);
  std::string text = data;
  text.resize(64, ' ');
  return text + end;
}

/// Two entities: a transformation (124), and a point (116) that uses it, of two lines.
std::vector<std::string> good() {
  return {line("made by hand", 'S', 1),
          line("1H,,1H;,4Hpart;", 'G', 1),
          line(fields({124, 1, 0, 0, 0, 0, 0, 0, 0}), 'D', 1),
          line(fields({124, 0, 0, 1, 0}), 'D', 2),
          line(fields({116, 2, 0, 0, 0, 0, 1, 0, 0}), 'D', 3),
          line(fields({116, 0, -1, 2, 0}), 'D', 4),
          line(parameters("124,1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.;", 1), 'P', 1),
          line(parameters("116,1.,2.,", 3), 'P', 2),
          line(parameters("3.,0;", 3), 'P', 3),
          line(counts(1, 1, 4, 3), 'T', 1)};
}

std::string joined(const std::vector<std::string>& lines, const char* end = "\n") {
  std::string text;
  for (const std::string& one : lines) text += one + end;
  return text;
}

/// Error for good() with line `which`, from 1, replaced.
std::string refusal_with(std::size_t which, const std::string& replacement) {
  std::vector<std::string> lines = good();
  lines.at(which - 1) = replacement;
  return message_of<InputError>([&] { check_iges(joined(lines), "x.igs"); });
}

std::string refusal(const std::string& content) {
  return message_of<InputError>([&] { check_iges(content, "x.igs"); });
}

TEST(IgesCheck, WholeFilesAreCounted) {
  EXPECT_EQ(check_iges(joined(good()), "x"), 2);
  EXPECT_EQ(check_iges(joined(good(), "\r\n"), "x"), 2);
  EXPECT_EQ(check_iges(joined(good(), "   \n") + "\n \n", "x"), 2) << "blanks belong to no line";
}

TEST(IgesCheck, WhatIsNoIgesFileIsRefused) {
  for (const char* text : {"", "solid lens\nendsolid\n", "ISO-10303-21;\n"}) {
    EXPECT_THAT(refusal(text), HasSubstr("x.igs: is no IGES file")) << text;
  }
  EXPECT_THAT(refusal(line("", 'C', 1) + "\n"), HasSubstr("compressed form, which is not read"));
  EXPECT_THAT(refusal(line("", 'B', 1) + "\n"), HasSubstr("binary form"));
}

TEST(IgesCheck, CutShortFilesAreRefused) {
  std::vector<std::string> lines = good();
  lines.pop_back();
  EXPECT_THAT(refusal(joined(lines)), HasSubstr("is cut short: its last line is not section T"));
  EXPECT_THAT(
      refusal_with(9, good()[8].substr(0, 50)),
      AllOf(HasSubstr("line 9: has 50 columns instead of 80"), HasSubstr("write the file")));
}

TEST(IgesCheck, SectionsStandInTheirOrderAndAreNumbered) {
  EXPECT_THAT(refusal_with(3, line("", 'X', 1)), HasSubstr("line 3: column 73 names none"));
  EXPECT_THAT(refusal_with(7, line("", 'G', 2)), HasSubstr("section G stands behind section D"));
  EXPECT_THAT(refusal_with(8, line(parameters("116,1.,2.,", 3), 'P', 3)),
              HasSubstr("line 8: is not numbered 2 in section P"));
  EXPECT_THAT(refusal(joined(good()) + "more\n"), HasSubstr("line 10: is section T, but lines"));
}

TEST(IgesCheck, TheLastLineCountsTheOthers) {
  EXPECT_THAT(refusal_with(10, line(counts(1, 1, 4, 4), 'T', 1)),
              HasSubstr("line 10: counts 4 lines of section P, the file has 3"));
  EXPECT_THAT(refusal_with(10, line("", 'T', 1)), HasSubstr("counts 0 lines of section S"));
}

TEST(IgesCheck, PointersLeadSomewhere) {
  EXPECT_THAT(
      refusal_with(5, line(fields({116, 9, 0, 0, 0, 0, 1, 0, 0}), 'D', 3)),
      HasSubstr("line 5: its parameters are 2 lines from line 9 of section P, which has 3"));
  EXPECT_THAT(refusal_with(6, line(fields({116, 0, 0, 3, 0}), 'D', 4)),
              HasSubstr("3 lines from line 2"));
  EXPECT_THAT(refusal_with(5, line(fields({116, 2, 0, 0, 0, 0, 7, 0, 0}), 'D', 3)),
              HasSubstr("line 5: points to line 7 of section D, where no entry begins"));
  EXPECT_THAT(refusal_with(5, line(fields({116, 2, -2, 0, 0, 0, 1, 0, 0}), 'D', 3)),
              HasSubstr("points to line 2"));
  EXPECT_THAT(refusal_with(9, line(parameters("3.,0;", 5), 'P', 3)), HasSubstr("line 9: points"));
}

TEST(IgesCheck, EntriesAreTwoLinesOfWholeNumbers) {
  EXPECT_THAT(refusal_with(6, line(fields({110, 0, 0, 2, 0}), 'D', 4)),
              HasSubstr("line 6: is of another entity than the line before it"));
  EXPECT_THAT(refusal_with(5, line("     1.5", 'D', 3)),
              HasSubstr("line 5: columns 1 to 8 hold '1.5', which is no whole number"));
  std::vector<std::string> lines = good();
  lines.erase(lines.begin() + 5);
  lines.back() = line(counts(1, 1, 3, 3), 'T', 1);
  EXPECT_THAT(refusal(joined(lines)), HasSubstr("line 5: is half a directory entry"));
}

}  // namespace
}  // namespace lensforge::testing
