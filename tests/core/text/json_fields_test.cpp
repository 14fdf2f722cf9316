// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/json_fields.h"

#include <gtest/gtest.h>

#include <tuple>

#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using nlohmann::json;

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

}  // namespace
}  // namespace lensforge
