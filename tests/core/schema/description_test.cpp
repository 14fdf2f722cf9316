// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/description.h"

#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "core/error.h"
#include "core/schema/json.h"
#include "core/schema/toml.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

enum class Side { kLeft, kRight };

struct ToyPart {
  double mass = 1.5;

  friend bool operator==(const ToyPart&, const ToyPart&) = default;
};

struct Toy {
  bool arcs = true;
  bool loud = false;
  int count = 3;
  double depth = 0.5;
  double speed = 2.0;
  std::optional<Side> side;
  std::string name = "a";
  ToyPart lid;
  std::vector<ToyPart> parts{{0.1}, {1.0 / 3.0}};

  friend bool operator==(const Toy&, const Toy&) = default;
};

}  // namespace

static void describe(Description& d, ToyPart& part) {
  d.number("mass", part.mass, Limits::between(0, 9), "g", "g").needed = true;
}

static void describe(Description& d, Toy& toy) {
  d.without("no-arcs", toy.arcs, "no arcs");
  d.flag("loud", toy.loud, "as loud as it can").left_out = "it is not heard";
  d.whole("count", toy.count, Limits::zero_or(2, 9), "toys in a box");
  d.length("depth", toy.depth, Limits::above(0, 1), "mm below the lid");
  d.number("top-speed", toy.speed, Limits::between(0, 5), "m/s", "downhill");
  d.word("side", toy.side, {{"none", std::nullopt}, {"left", Side::kLeft}}, "of the key");
  d.text("name", toy.name, "NAME", "on the box");
  d.table("lid", toy.lid, "The lid.");
  d.list("part", toy.parts, "All other parts.");
}

namespace {

using ::testing::HasSubstr;
using testing::message_of;
using ::testing::StrEq;

Toy other_toy() {
  return {false, true, 5, 0.1 + 0.2, 1e-7, Side::kLeft, "b \"c\"", {2.5}, {{1.0 / 7.0}}};
}

TEST(Description, FieldsReadAndWriteTheirMember) {
  Toy toy;
  const Description fields = description_of(toy);
  const FieldValue values[] = {true, true, 5, 0.25, 4.0, "left", "b"};
  for (std::size_t i = 0; i < std::size(values); ++i) {
    const Field& field = *(fields.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_NE(field.get(), values[i]) << field.name;
    field.set(values[i]);
    EXPECT_EQ(field.get(), values[i]) << field.name;
  }
  EXPECT_FALSE(toy.arcs);
  EXPECT_EQ(toy.side, Side::kLeft);
  EXPECT_THAT(toy.name, StrEq("b"));
}

TEST(Description, NumbersComeBackFromJsonAndKeepTheirCount) {
  Eigen::Vector3d place(0.1, -2.0, 1.0 / 3.0);
  std::vector<double> shares;
  Description fields;
  fields.numbers("place", place, "").needed = true;
  fields.numbers("shares", shares, "").zero_if_missing = true;
  nlohmann::json written = json_of(fields);
  EXPECT_FALSE(written.contains("shares"));
  shares = {0.5, 0.1 + 0.2};
  written = json_of(fields);
  place.setZero();
  shares.clear();
  read_json(fields, JsonFields(written, "toy.json"));
  EXPECT_EQ(place, Eigen::Vector3d(0.1, -2.0, 1.0 / 3.0));
  EXPECT_EQ(shares, (std::vector<double>{0.5, 0.1 + 0.2}));
  written["place"] = {1.0, 2.0};
  EXPECT_THAT(message_of<InputError>([&] { read_json(fields, JsonFields(written, "toy.json")); }),
              StrEq("toy.json: field 'place' is [1.0,2.0]: it must be three numbers"));
  written["place"] = {1.0, 2.0, 3.0};
  written["shares"] = {"a"};
  EXPECT_THAT(message_of<InputError>([&] { read_json(fields, JsonFields(written, "toy.json")); }),
              HasSubstr("'shares' is [\"a\"]: it must be a list of numbers"));
}

TEST(Description, OfAConstantBelongsToACopy) {
  const Toy toy;
  const Description fields = description_of(toy);
  fields.at("count").set(7);
  EXPECT_EQ(fields.at("count").get(), FieldValue(7));
  EXPECT_EQ(toy, Toy());
}

TEST(Description, FindsFieldsByTheirPath) {
  Toy toy;
  const Description fields = description_of(toy);
  fields.at("lid.mass").set(4.5);
  EXPECT_EQ(toy.lid.mass, 4.5);
  toy.parts.clear();
  EXPECT_EQ(fields.at("part.mass").limits.high, 9.0);
  EXPECT_EQ(fields.only({"name", "side"}).size(), 2U);
  EXPECT_EQ(fields.except({"name", "side"}).size() + 2, fields.size());
}

TEST(Description, AFieldKeepsItsPlaceUnderAnotherName) {
  Toy toy;
  Description options;
  const Field& field = options.like(description_of(toy).at("side"), "--key", "side of the key");
  EXPECT_THAT(message_of<InputError>([&] { field.set("up"); }),
              StrEq("--key up: must be one of none, left"));
  field.set("left");
  EXPECT_EQ(toy.side, Side::kLeft);
  EXPECT_FALSE(options.like(description_of(toy).at("lid.mass"), "--mass", "").needed);
}

TEST(Description, LimitsHoldWhatTheirRuleSays) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(Limits::zero_or(2, 9).hold(0) && Limits::zero_or(2, 9).hold(9));
  EXPECT_FALSE(Limits::zero_or(2, 9).hold(1) || Limits::zero_or(2, 9).hold(nan));
  EXPECT_FALSE(Limits::above(0, 1).hold(0));
  EXPECT_TRUE(Limits::between(0, 1).hold(0));
  EXPECT_THAT(Limits::zero_or(2, 9).rule(), StrEq("0, or 2 to 9"));
  EXPECT_THAT(Limits::above(0, 1e7).rule(), StrEq("above 0, at most 1e+07"));
  EXPECT_THAT(Limits{.low = 3}.rule(), StrEq("3 or more"));
}

TEST(Description, ANumberOutsideItsLimitsIsNamedWithValueAndRule) {
  Toy toy;
  require_limits(toy);
  toy.depth = 0.0;
  EXPECT_THAT(message_of<InputError>([&] { require_limits(toy); }),
              StrEq("depth 0: must be above 0, at most 1 mm"));
  toy.depth = 1.0;
  toy.count = 1;
  EXPECT_THAT(message_of<InputError>([&] { require_limits(toy); }),
              StrEq("count 1: must be 0, or 2 to 9"));
}

TEST(Description, TomlGivesTheSameObject) {
  const std::string text = toml_text(description_of(other_toy()));
  EXPECT_THAT(text, HasSubstr("depth = 0.30000000000000004  # mm below the lid\n"));
  EXPECT_THAT(text, HasSubstr("\n# All other parts.\n[[part]]\nmass = 0.14285714285714285  # g\n"));
  Toy toy;
  read_toml(description_of(toy), TomlFields(text, {"toy.toml", "a toy"}));
  EXPECT_EQ(toy, other_toy());
  EXPECT_EQ(toml_text(description_of(toy)), text);
}

TEST(Description, TomlIsReadStrictly) {
  Toy toy;
  const auto refusal = [&](const char* text) {
    return message_of<InputError>([&] {
      read_toml(description_of(toy), TomlFields(text, {"toy.toml", "a toy"}));
    });
  };
  EXPECT_EQ(refusal("count = 1\n"), "toy.toml: count: 1: must be in 0, or 2 to 9");
  EXPECT_EQ(refusal("side = 'up'\n"), "toy.toml: side: 'up': must be one of: none, left");
  EXPECT_EQ(refusal("[lid]\n"), "toy.toml: lid.mass: missing: a toy needs this key");
  EXPECT_EQ(refusal("[[part]]\nmass = 1\nmas = 2\n"),
            "toy.toml: part[0].mas: 2: a toy: unknown key; use mass");
  toy = Toy();
  read_toml(description_of(toy), TomlFields("", {"toy.toml", "a toy"}));
  EXPECT_EQ(toy, Toy());
  toy.parts[1].mass = 10.0;
  EXPECT_EQ(message_of<InputError>([&] { require_toml_limits(description_of(toy), "shop"); }),
            "shop: part[1].mass: 10: must be in 0 to 9");
}

TEST(Description, JsonGivesTheSameObject) {
  const nlohmann::json document =
      parse_json(json_of(description_of(other_toy())).dump(), "toy.json");
  Toy toy;
  read_json(description_of(toy), JsonFields(document, "toy.json"));
  EXPECT_EQ(toy, other_toy());
}

TEST(Description, JsonIsReadWithItsRules) {
  Toy toy;
  const auto refusal = [&](const char* text) {
    const nlohmann::json document = parse_json(text, "toy.json");
    return message_of<InputError>(
        [&] { read_json(description_of(toy), JsonFields(document, "toy.json")); });
  };
  EXPECT_EQ(refusal(R"({"side": "up"})"),
            R"(toy.json: field 'side' is "up": it must be "none" or "left")");
  EXPECT_EQ(refusal(R"({"count": 1})"), "toy.json: field 'count' is 1: it must be 0, or 2 to 9");
  EXPECT_EQ(refusal(R"({"part": [{"mass": 1}, {}]})"), "toy.json: field 'part[1].mass' is missing");
}

TEST(Description, JsonHasNullForANumberThatIsNotFinite) {
  double value = std::numeric_limits<double>::infinity();
  Description fields;
  fields.number("value", value, {}, "", "").infinite_if_null = true;
  EXPECT_EQ(json_of(fields).dump(), R"({"value":null})");
  value = 1.5;
  EXPECT_EQ(json_of(fields).dump(), R"({"value":1.5})");
  read_json(fields, JsonFields({{"value", nullptr}}, "toy.json"));
  EXPECT_EQ(value, std::numeric_limits<double>::infinity());
}

TEST(Description, ARowHoldsItsValuesInOrder) {
  const std::set<std::string> lists{"lid", "part"};
  const nlohmann::json row = row_of(description_of(other_toy()).except(lists));
  EXPECT_EQ(row.dump(), R"([true,true,5,0.30000000000000004,1e-07,"left","b \"c\""])");
  Toy toy;
  read_row(description_of(toy).except(lists), row);
  EXPECT_EQ(row_of(description_of(toy).except(lists)), row);
  EXPECT_THROW(read_row(description_of(toy), {true, true}), nlohmann::json::exception);
  EXPECT_THROW(read_row(description_of(toy), {true, "no"}), nlohmann::json::exception);
}

TEST(Description, AFingerprintHoldsWhatIsNotLeftOut) {
  nlohmann::json values = nlohmann::json::array();
  append_fingerprint(description_of(ToyPart()), values);
  append_fingerprint(description_of(Toy()).except({"lid", "part"}), values);
  EXPECT_EQ(values.dump(), R"([1.5,true,3,0.5,2.0,"none","a"])");
}

/// A field that is added to a description is found by everything that works from it.
TEST(Description, OneLineIsEnoughForANewField) {
  Toy toy;
  double wheels = 4.0;
  Description fields = description_of(toy).except({"lid", "part"});
  fields.number("--spare-wheels", wheels, Limits::between(0, 8), "pairs", "under the lid");
  const Field field = fields.at("--spare-wheels");
  EXPECT_EQ(help_text(field), "under the lid; pairs, 0 to 8");
  EXPECT_EQ(manual_item(field),
            ".It Fl -spare-wheels Ar NUMBER\nunder the lid; pairs, 0 to 8.\nDefault: 4.\n");
  EXPECT_EQ(docstring_line(field), "\n  spare_wheels (float): under the lid; 0 to 8");
  EXPECT_EQ(docstring_line(field, "4"),
            "\n  spare_wheels (float): under the lid; 0 to 8; default 4");
  field.set(value_of(field, "0.1"));
  EXPECT_EQ(wheels, 0.1);
  EXPECT_EQ(message_of<InputError>([&] { (void)value_of(field, "9"); }),
            "--spare-wheels 9: must be 0 to 8 pairs");
  const std::string text = toml_text(fields);
  const nlohmann::json document = json_of(fields);
  nlohmann::json values = nlohmann::json::array();
  append_fingerprint(fields, values);
  EXPECT_EQ(values.back(), 0.1);
  wheels = 9.0;
  EXPECT_THROW(fields.require_limits(), InputError);
  read_toml(fields, TomlFields(text, {"toy.toml", "a toy"}));
  EXPECT_EQ(wheels, 0.1);
  wheels = 9.0;
  read_json(fields, JsonFields(document, "toy.json"));
  EXPECT_EQ(wheels, 0.1);
}

TEST(Description, MessagesForPythonNameKeywords) {
  EXPECT_EQ(in_keywords("--image-width -1: must be 0 or more; (--focal 300 works)"),
            "image_width -1: must be 0 or more; (focal 300 works)");
  EXPECT_EQ(in_keywords("a--b/--c.png: -- is no option"), "a--b/--c.png: -- is no option");
  EXPECT_EQ(in_keywords(""), "");
}

}  // namespace
}  // namespace lensforge
