// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/json_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/error.h"
#include "core/temp_folder.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using ::testing::HasSubstr;
using ::testing::Not;

std::string refusal(const std::string& text) {
  std::string message = message_of<InputError>([&] { (void)parse_json(text, "f.json"); });
  EXPECT_EQ(printable_line(message, 150), message);
  EXPECT_THAT(message, Not(HasSubstr("json.exception")));
  return message;
}

TEST(JsonText, AWholeDocumentIsRead) {
  EXPECT_EQ(parse_json(R"({"a": [1, {"a": 2}], "b": {"a": null}})", "f.json").at("a").at(0), 1);
}

TEST(JsonText, ANumberBeyondADoubleIsRefusedInOurWords) {
  EXPECT_THAT(refusal(R"({"a": 1e400})"), HasSubstr("f.json: holds a number that is too large"));
}

TEST(JsonText, ANameThatStandsTwiceIsRefused) {
  EXPECT_EQ(refusal(R"({"a": {"b": 1}, "b": 2, "a": 3})"), "f.json: has the field 'a' twice");
  EXPECT_EQ(refusal(R"({"\u001b": 1, "\u001b": 2})"), "f.json: has the field '?' twice");
}

TEST(JsonText, DeepNestingIsRefused) {
  EXPECT_EQ(refusal(std::string(100'000, '[')), "f.json: is nested more than 64 deep");
  std::string objects;
  for (int i = 0; i < 100'000; ++i) objects += R"({"a":)";
  EXPECT_EQ(refusal(objects), "f.json: is nested more than 64 deep");
}

TEST(JsonText, WhatIsNoUtf8IsRefusedByItsByte) {
  EXPECT_EQ(refusal("{\"a\": \"\xff\"}"), "f.json: is no JSON: byte 8 of 10 cannot be understood");
  EXPECT_THAT(refusal(""), HasSubstr("is no JSON"));
}

}  // namespace
}  // namespace lensforge
