// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "app/commands/cam_command.h"
#include "app/commands/design_command.h"
#include "app/commands/send_command.h"
#include "app/commands/settings.h"
#include "app/frame/option_set.h"
#include "cam/coupon/coupon.h"
#include "cam/plan/cam_options.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/schema/description.h"
#include "core/schema/json.h"
#include "core/schema/toml.h"
#include "design/reflect/input.h"
#include "design/setup/design_options.h"
#include "export/export.h"
#include "machine/send.h"

/// Every description, by everything that works from one.
namespace lensforge::app {
namespace {

using ::testing::HasSubstr;

/// Another value within the field's limits; a text stays as it is.
FieldValue other_value(const Field& field) {
  switch (field.kind) {
    case FieldKind::kFlag:
      return !std::get<bool>(field.get());
    case FieldKind::kWord:
      return FieldValue(field.words.front()) == field.get() ? field.words.back()
                                                            : field.words.front();
    case FieldKind::kWhole:
      return static_cast<int>(field.limits.high);
    case FieldKind::kNumber:
    case FieldKind::kLength:
      return 0.3 * std::max(field.limits.low, 0.0) + 0.7 * field.limits.high;
    default:
      return field.get();
  }
}

void change(const Description& fields) {
  for (const Field& field : fields) {
    if (!field.parts) field.set(other_value(field));
    for (const Description& part : field.parts ? field.parts() : std::vector<Description>()) {
      change(part);
    }
  }
}

/// An object written and read back is the same; so is a default object that reads it.
/// @param fields  of the object. @param fresh  of a default one.
void expect_files_hold(const Description& fields, const Description& fresh) {
  change(fields);
  const nlohmann::json document = json_of(fields);
  const std::string text = toml_text(fields);
  require_toml_limits(fields, "file");
  read_json(fresh, JsonFields(document, "file"));
  EXPECT_EQ(json_of(fresh), json_of(fields));
  read_toml(fresh, TomlFields(text, {"file", "a file"}));
  EXPECT_EQ(toml_text(fresh), text);
}

/// The fields but for texts that are empty, which TOML files leave out.
template <class Options>
Description written_fields(Options& options) {
  std::set<std::string> empty;
  for (const Field& field : description_of(options)) {
    if (field.get() == FieldValue("")) empty.insert(field.name);
  }
  return description_of(options).except(empty);
}

std::string output_of(const Description& fields, const Arguments& arguments) {
  OptionSet options("command", "");
  options.add(fields);
  try {
    options.parse(arguments);
  } catch (const HelpText& help) {
    return help.text;
  }
  return {};
}

std::set<std::string> listed(const Description& fields) {
  OptionSet options("command", "");
  options.add(fields);
  std::set<std::string> names;
  try {
    options.parse({kListOptions});
  } catch (const ListedOptions& listed) {
    for (const FieldSpec& spec : listed.options) names.insert(spec.name);
  }
  return names;
}

/// A field as a word of the command line.
std::string word_of(const Field& field, const FieldValue& value) {
  if (field.kind == FieldKind::kFlag) return field.name;
  const std::string text =
      field.is_number() ? nlohmann::json(number_of(value)).dump() : value_text(value);
  return field.name + "=" + (field.kind == FieldKind::kWhole ? value_text(value) : text);
}

template <class Options>
void expect_options_found() {
  Options options;
  const Description fields = description_of(options);
  const std::string help = output_of(fields, {"--help"});
  const std::string manual = output_of(fields, {"--help-man"});
  const std::set<std::string> names = listed(fields);
  nlohmann::json fingerprint = nlohmann::json::array();
  append_fingerprint(fields, fingerprint);
  std::size_t stored = 0;
  for (const Field& field : fields) {
    EXPECT_THAT(help, HasSubstr(field.name == "--out" ? "\n  -o,--out" : "\n  " + field.name));
    EXPECT_THAT(help, HasSubstr(help_text(field)));
    if (field.name.starts_with('-')) {
      EXPECT_THAT(manual, HasSubstr(manual_item(field)));
    }
    EXPECT_TRUE(names.contains(field.name)) << field.name;
    EXPECT_THAT(docstring_line(field), HasSubstr(keyword_of(field.name) + " ("));
    stored += field.left_out.empty() ? 1 : 0;
  }
  EXPECT_EQ(fingerprint.size(), stored);
  require_limits(options);
}

/// The same option set by its value, as by a keyword of Python.
template <class Options>
FieldValue taken(const std::string& name, const FieldValue& value) {
  Options options;
  const Description fields = description_of(options);
  OptionSet set("command", "");
  set.add(fields);
  set.take({{name, value}});
  EXPECT_TRUE(set.given(name));
  return fields.at(name).get();
}

/// Every option by the command line and by its value, alone.
template <class Options>
void expect_options_set() {
  for (std::size_t i = 0; i < description_of(Options()).size(); ++i) {
    Options options;
    const Description fields = description_of(options);
    const Field& field = *(fields.begin() + static_cast<std::ptrdiff_t>(i));
    if (field.kind == FieldKind::kText) continue;
    const FieldValue before = field.get();
    const FieldValue wanted = other_value(field);
    output_of(fields, {word_of(field, wanted)});
    const FieldValue parsed = field.get();
    EXPECT_NE(parsed, before) << field.name;
    field.set(wanted);  // A size is kept in whole bytes.
    EXPECT_EQ(parsed, field.get()) << field.name;
    EXPECT_EQ(taken<Options>(field.name, wanted), parsed) << field.name;
  }
}

template <class Options>
void walk() {
  expect_options_found<Options>();
  expect_options_set<Options>();
  Options changed;
  Options fresh;
  expect_files_hold(written_fields(changed), written_fields(fresh));
}

TEST(Descriptions, OfOptionsAreFoundByEverything) {
  walk<DesignOptions>();
  walk<LightOptions>();
  walk<ObjectiveWeights>();
  walk<Background>();
  walk<RenderOptions>();
  walk<CamOptions>();
  walk<CouponOptions>();
  walk<ExportOptions>();
  walk<reflect::ReflectOptions>();
  walk<SendOptions>();
}

TEST(Descriptions, OfCommandsSettingsAreFoundByTheCommandLine) {
  expect_options_found<DesignSettings>();
  expect_options_found<CamSettings>();
  expect_options_found<NestSettings>();
  expect_options_found<CouponSettings>();
  expect_options_found<ExportSettings>();
  expect_options_found<ReflectSettings>();
  expect_options_found<SendSettings>();
}

TEST(Descriptions, OfWorkshopsAreFoundByEveryFile) {
  Workshop changed;
  changed.material.ior = 1.49;
  changed.keep_outs.push_back({"clamp", {0.0, 0.0, 0.0}, {1.0, 2.0, 3.0}});
  Workshop fresh;
  expect_files_hold(description_of(changed), description_of(fresh));
  EXPECT_EQ(fresh, changed);
}

}  // namespace
}  // namespace lensforge::app
