// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <tuple>

#include "core/error.h"
#include "core/temp_folder.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

const json kDocument = json::parse(R"({
  "text": "abc", "number": 1.5, "whole": 7, "big": 3000000000, "pair": [1, 2.5],
  "whole_pair": [3, 4], "triple": [1, 2, 3], "inner": {"deep": true}, "nothing": null})");

TEST(JsonFields, ReadsEveryType) {
  const JsonFields fields(kDocument, "f.json");
  EXPECT_EQ(fields.text("text"), "abc");
  EXPECT_EQ(fields.number("number"), 1.5);
  EXPECT_EQ(fields.number("whole"), 7.0);
  EXPECT_EQ(fields.integer("whole"), 7);
  EXPECT_EQ(fields.number_pair("pair"), Eigen::Vector2d(1.0, 2.5));
  EXPECT_EQ(fields.integer_pair("whole_pair"), Eigen::Vector2i(3, 4));
  EXPECT_TRUE(fields.has("nothing"));
  EXPECT_FALSE(fields.has("other"));
}

TEST(JsonFields, AMissingFieldIsNamedWithItsPath) {
  const JsonFields fields(kDocument, "f.json");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.number("ior"); }),
            "f.json: field 'ior' is missing");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.object("inner").text("other"); }),
            "f.json: field 'inner.other' is missing");
}

TEST(JsonFields, AMistypedFieldIsNamedWithItsValue) {
  const JsonFields fields(kDocument, "f.json");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.number("text"); }),
            "f.json: field 'text' is \"abc\": it must be a number");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.text("number"); }),
            "f.json: field 'number' is 1.5: it must be a text");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.integer("number"); }),
            "f.json: field 'number' is 1.5: it must be a whole number");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.integer("big"); }),
            "f.json: field 'big' is 3000000000: it must be a whole number");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.number_pair("triple"); }),
            "f.json: field 'triple' is [1,2,3]: it must be two numbers");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.integer_pair("pair"); }),
            "f.json: field 'pair' is [1,2.5]: it must be two whole numbers");
  EXPECT_EQ(message_of<InputError>([&] { std::ignore = fields.object("nothing"); }),
            "f.json: field 'nothing' is null: it must be an object");
}

TEST(JsonFields, ALongValueIsCutToOneLine) {
  const json document{{"text", std::string(500, 'x')}};
  const JsonFields fields(document, "f.json");
  EXPECT_LT(message_of<InputError>([&] { std::ignore = fields.number("text"); }).size(), 150U);
}

TEST(JsonFields, WhatIsNoObjectIsRefused) {
  EXPECT_THROW(JsonFields(json::array({1, 2}), "f.json"), InputError);
}

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
