// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/toml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "core/error.h"
#include "core/schema/toml_document.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const TomlSource kSource{"a.toml", "a list"};

TEST(TomlFields, ReadsWhatStands) {
  TomlFields fields("name = 'x'\nlines = ['a', 'b']\nnone = []\non = true\n[part]\nsize = 2.5\n",
                    kSource);
  EXPECT_EQ(fields.text("name"), "x");
  EXPECT_EQ(fields.text_or("other", "y"), "y");
  EXPECT_THAT(fields.texts("lines"), ElementsAre("a", "b"));
  EXPECT_THAT(fields.texts("none"), ElementsAre());
  EXPECT_TRUE(fields.flag("on"));
  TomlFields part = fields.table("part");
  EXPECT_DOUBLE_EQ(part.number("size", {0.0, 3.0}), 2.5);
  EXPECT_NO_THROW(part.finish());
  EXPECT_NO_THROW(fields.finish());
}

TEST(TomlFields, RefusesWithFileKeyValueAndRule) {
  TomlFields fields("lines = ['a', 3]\nblank = [' ']\non = 1\n[part]\nz = 9\n", kSource);
  const auto refusal = [](const auto& action) { return message_of<InputError>(action); };
  EXPECT_EQ(refusal([&] { (void)fields.text("name"); }),
            "a.toml: name: missing: a list needs this key");
  EXPECT_EQ(refusal([&] { (void)fields.texts("lines"); }),
            "a.toml: lines: an array: must be an array of strings");
  EXPECT_THAT(refusal([&] { (void)fields.texts("blank"); }), HasSubstr("not blank"));
  EXPECT_EQ(refusal([&] { (void)fields.flag("on"); }), "a.toml: on: 1: must be true or false");
  TomlFields part = fields.table("part");
  EXPECT_EQ(refusal([&] {
              (void)part.number("z", {0.0, 3.0});
            }),
            "a.toml: part.z: 9: must be in 0 to 3");
  EXPECT_NO_THROW(fields.finish());
}

TEST(TomlFields, RefusesKeysThatNoneAskedFor) {
  const TomlFields fields("extra = 'x'\n", kSource);
  EXPECT_EQ(message_of<InputError>([&] { fields.finish(); }),
            "a.toml: extra: 'x': a list: unknown key");
}

TEST(TomlFields, NamesTheKeyThatWasLikelyMeant) {
  for (const auto& [written, meant] :
       {std::pair("picth", "; use pitch"), std::pair("pitchh", "; use pitch"),
        std::pair("ptch", "; use pitch"), std::pair("on", ""), std::pair("pitch_error", ""),
        std::pair("aa", "")}) {
    TomlFields fields(std::string(written) + " = 1\n", kSource);
    (void)fields.number_or("pitch", {0.0, 1.0}, 0.5);
    (void)fields.number_or("a", {0.0, 1.0}, 0.5);
    EXPECT_EQ(message_of<InputError>([&] { fields.finish(); }),
              std::string("a.toml: ") + written + ": 1: a list: unknown key" + meant);
  }
}

TEST(TomlFields, ShowsNumbersAsTheyWereWritten) {
  for (const char* number : {"0.05", "0.1", "1e-07", "123.456", "-2.5"}) {
    const TomlFields fields("x = " + std::string(number) + "\n", kSource);
    EXPECT_THAT(message_of<InputError>([&] { fields.finish(); }),
                StartsWith("a.toml: x: " + std::string(number) + ": "));
  }
}

TEST(TomlFields, RefusesWhatIsNotToml) {
  EXPECT_THAT(message_of<InputError>([] { (void)parse_toml("a = 1\nb = \n", "f.toml"); }),
              StartsWith("f.toml: line 2: not TOML: "));
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

TEST(TomlFields, RefusesAKeyOfManyPartsBeforeItIsParsed) {
  for (const std::string& text : {"a = 1\na" + repeated(".a", 100'000) + " = 1\n",
                                  "a = 1\n[a" + repeated(".\"a\"", 100'000) + "]\n",
                                  "a = 1\nb = {a" + repeated(" . 'a'", 100'000) + " = 1}\n"}) {
    EXPECT_EQ(message_of<InputError>([&] { (void)parse_toml(text, "f.toml"); }),
              "f.toml: line 2: a key has more than 32 parts");
  }
}

TEST(TomlFields, RefusesDeepBracketsBeforeTheyAreParsed) {
  for (const char* bracket : {"[", "{a="}) {
    EXPECT_EQ(message_of<InputError>(
                  [&] { (void)parse_toml("a = " + repeated(bracket, 100'000), "f.toml"); }),
              "f.toml: line 1: brackets are nested more than 32 deep");
  }
}

TEST(TomlFields, DotsAndBracketsInStringsCommentsAndNumbersDoNotNest) {
  const std::string dots = repeated(".[{", 50);
  const std::string text = "# " + dots + "\na = \"\\\"" + dots + "\"\nb = '" + dots +
                           "'\nc = '''\n" + dots + "'''\nd = [" + repeated("1.5, ", 50) +
                           "]\ne = \"\"\"" + dots + "\"\"\"\n";
  EXPECT_EQ(parse_toml(text, "f.toml").size(), 5U);
}

TEST(TomlFields, RefusesALargeText) {
  EXPECT_THAT(
      message_of<InputError>([] { (void)parse_toml(std::string((1U << 20U) + 1, ' '), "f.toml"); }),
      HasSubstr("at most 1 MiB"));
}

TEST(TomlFields, RefusesFilesThatAreMissingOrLarge) {
  const TempFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { (void)read_toml_file(folder / "no", "a list"); }),
              HasSubstr("cannot be read"));
  write_bytes(folder / "big", std::string((1U << 20U) + 1, ' '));
  EXPECT_THAT(message_of<InputError>([&] { (void)read_toml_file(folder / "big", "a list"); }),
              HasSubstr("a list has at most 1 MiB"));
}

}  // namespace
}  // namespace lensforge
