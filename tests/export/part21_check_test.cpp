// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "core/error.h"
#include "core/temp_folder.h"
#include "export/solid/solid_files.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

std::string file_with(const std::string& data) {
  return "ISO-10303-21;\nHEADER;\nFILE_NAME('a','b');\nENDSEC;\nDATA;\n" + data +
         "ENDSEC;\nEND-ISO-10303-21;\n";
}

std::string refusal(const std::string& content) {
  return message_of<InputError>([&] { check_part21(content, "x.step"); });
}

TEST(Part21Check, WholeFilesAreCounted) {
  EXPECT_EQ(check_part21(file_with(""), "x"), 0);
  EXPECT_EQ(check_part21(file_with("#1=A(#2,'#9;)(''/*',\"0A#9\");\n #2 = B($,*);\n"), "x"), 2);
  EXPECT_EQ(check_part21(file_with("/* #9 (; */ #10=(A(1.)B(#10));\n"), "x"), 1);
  EXPECT_EQ(check_part21("\r\n " + file_with("#4=A(.T.,-1.E-3);"), "x"), 1);
}

TEST(Part21Check, WhatIsNoStepFileIsRefused) {
  EXPECT_THAT(refusal(""), HasSubstr("x.step: is no STEP file"));
  EXPECT_THAT(refusal("solid x\nendsolid\n"), HasSubstr("is no STEP file"));
  EXPECT_THAT(refusal("ISO-10303-21;\nHEADER;\nENDSEC;\n"), HasSubstr("no DATA section"));
}

TEST(Part21Check, CutShortFilesAreRefused) {
  EXPECT_THAT(refusal("ISO-10303-21;\nDATA;\n#1=A(2.);\n"), HasSubstr("is cut short"));
  EXPECT_THAT(refusal("ISO-10303-21;\nDATA;\n#1=A('2.);\n"),
              HasSubstr("line 3: a text has no end"));
  EXPECT_THAT(refusal("ISO-10303-21;\nDATA;/*"), HasSubstr("comment"));
}

TEST(Part21Check, DanglingAndDoubleEntitiesAreNamedWithTheirLine) {
  EXPECT_THAT(refusal(file_with("#1=A(#2);\n#2=B(#77);\n")),
              HasSubstr("x.step: line 7: #77 is used but nowhere defined"));
  EXPECT_THAT(refusal(file_with("#5=A();\n#4=A();\n#4=B();\n#5=B();\n")),
              HasSubstr("line 8: #4 is defined twice"));
  EXPECT_THAT(refusal(file_with("#99999999999999999999=A();\n")), HasSubstr("2147483647"));
}

TEST(Part21Check, WordsAreNumbersEnumerationsOrKeywords) {
  const std::string good = "#1=A(1,-2.,+3.5E-12,.UNSPECIFIED.,$,*,LENGTH(4.),@7,@PI,#PI, B ());\n";
  EXPECT_EQ(check_part21(file_with(good), "x"), 1);
  for (const std::string word : {"NaN", "1e400", "-", "..", "1.2.3", "INF", "0x1p3"}) {
    EXPECT_THAT(refusal(file_with("#1=A((" + word + ",2.));\n")),
                HasSubstr("line 6: " + word + " is no value"));
  }
}

TEST(Part21Check, ParenthesesMatch) {
  EXPECT_THAT(refusal(file_with("#1=A((1.);\n")), HasSubstr("line 6: parentheses"));
  EXPECT_THAT(refusal(file_with("#1=A(1.));\n")), HasSubstr("line 6: parentheses"));
}

}  // namespace
}  // namespace lensforge::testing
