// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::size_t kLongestShown = 60;

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw InputError(name + ": " + why);
}

std::string quoted(const std::string& word) {
  std::string text("'");
  text += printable_line(word, kLongestShown);
  text += '\'';
  return text;
}

/// Checks a document during parsing: nlohmann::json keeps the last of several equal names, and some
/// of its functions recurse into nested values.
class Watch {
 public:
  explicit Watch(const std::string& name) : name_(name) {}

  bool operator()(int /*depth*/, json::parse_event_t event, json& parsed) {
    using Event = json::parse_event_t;
    if (event == Event::object_start || event == Event::array_start) names_.emplace_back();
    if (event == Event::object_end || event == Event::array_end) names_.pop_back();
    if (names_.size() > kMaxJsonDepth) {
      refuse(name_, "is nested more than " + std::to_string(kMaxJsonDepth) + " deep");
    }
    if (event != Event::key) return true;
    const auto& key = parsed.get_ref<const std::string&>();
    if (!names_.back().insert(key).second) refuse(name_, "has the field " + quoted(key) + " twice");
    return true;
  }

 private:
  const std::string& name_;
  std::vector<std::set<std::string>> names_;  ///< Names in each open object or array.
};

/// A value as JSON, cut to fit on a line.
std::string shown(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return printable_line(text, kLongestShown);
}

bool is_int(const json& value) {
  if (!value.is_number_integer()) return false;
  if (value.is_number_unsigned()) {
    return value.get<std::uint64_t>() <= std::uint64_t{std::numeric_limits<int>::max()};
  }
  return std::in_range<int>(value.get<std::int64_t>());
}

bool is_pair(const json& value) { return value.is_array() && value.size() == 2; }

}  // namespace

json parse_json(std::string_view text, const std::string& name) {
  try {
    return json::parse(text, Watch(name));
  } catch (const json::parse_error& error) {
    refuse(name, "is no JSON: byte " + std::to_string(error.byte) + " of " +
                     std::to_string(text.size()) + " cannot be understood");
  } catch (const json::exception&) {
    // The parser's only other error.
    refuse(name, "holds a number that is too large: at most 1.8e308 can be read");
  }
}

JsonFields::JsonFields(const json& object, std::string file, std::string prefix)
    : object_(&object), file_(std::move(file)), prefix_(std::move(prefix)) {
  if (!object.is_object()) throw InputError(file_ + ": is no JSON object");
}

bool JsonFields::has(const std::string& name) const { return object_->contains(name); }

const json& JsonFields::at(const std::string& name) const {
  const auto found = object_->find(name);
  if (found == object_->end()) {
    throw InputError(file_ + ": field '" + prefix_ + name + "' is missing");
  }
  return *found;
}

JsonFields JsonFields::object(const std::string& name) const {
  if (!at(name).is_object()) refuse(name, "it must be an object");
  return JsonFields(at(name), file_, prefix_ + name + ".");
}

JsonFields JsonFields::item(const std::string& name, std::size_t index) const {
  return JsonFields(at(name).at(index), file_, prefix_ + name + "[" + std::to_string(index) + "].");
}

std::string JsonFields::text(const std::string& name) const {
  if (!at(name).is_string()) refuse(name, "it must be a text");
  return at(name).get<std::string>();
}

double JsonFields::number(const std::string& name) const {
  if (!at(name).is_number()) refuse(name, "it must be a number");
  return at(name).get<double>();
}

int JsonFields::integer(const std::string& name) const {
  if (!is_int(at(name))) refuse(name, "it must be a whole number");
  return at(name).get<int>();
}

bool JsonFields::flag(const std::string& name) const {
  if (!at(name).is_boolean()) refuse(name, "it must be true or false");
  return at(name).get<bool>();
}

std::vector<double> JsonFields::numbers(const std::string& name, std::size_t count) const {
  constexpr std::array kRules{"a list of numbers", "a number", "two numbers", "three numbers"};
  const json& value = at(name);
  const auto is_number = [](const json& entry) { return entry.is_number(); };
  if (!value.is_array() || (count > 0 && value.size() != count) ||
      !std::all_of(value.begin(), value.end(), is_number)) {
    refuse(name, std::string("it must be ") + kRules.at(count));
  }
  return value.get<std::vector<double>>();
}

Eigen::Vector2d JsonFields::number_pair(const std::string& name) const {
  return Eigen::Vector2d(numbers(name, 2).data());
}

Eigen::Vector3d JsonFields::number_triple(const std::string& name) const {
  return Eigen::Vector3d(numbers(name, 3).data());
}

Eigen::Vector2i JsonFields::integer_pair(const std::string& name) const {
  const json& value = at(name);
  if (!is_pair(value) || !is_int(value[0]) || !is_int(value[1])) {
    refuse(name, "it must be two whole numbers");
  }
  return {value[0].get<int>(), value[1].get<int>()};
}

void JsonFields::refuse(const std::string& name, const std::string& rule) const {
  throw InputError(file_ + ": field '" + prefix_ + name + "' is " + shown(at(name)) + ": " + rule);
}

json json_of(const FieldValue& value) {
  return std::visit(
      [](const auto& held) {
        if constexpr (std::is_same_v<std::decay_t<decltype(held)>, std::monostate>)
          return json();
        else
          return json(held);
      },
      value);
}

namespace {

/// A field's value; null for a number that it stands for.
json stored(const Field& field) {
  const FieldValue value = field.get();
  if (field.infinite_if_null && !std::isfinite(number_of(value))) return nullptr;
  return json_of(value);
}

/// @throw json::exception unless the value is of the kind.
FieldValue value_as(FieldKind kind, const json& value) {
  switch (kind) {
    case FieldKind::kFlag:
      return value.get<bool>();
    case FieldKind::kWhole:
      return value.get<int>();
    case FieldKind::kNumber:
    case FieldKind::kLength:
      return value.get<double>();
    default:
      return value.get<std::string>();
  }
}

}  // namespace

ordered_json json_of(const Description& description) {
  ordered_json object = ordered_json::object();
  for (const Field& field : description) {
    if (field.kind == FieldKind::kTable) {
      object[field.name] = json_of(field.parts().front());
    } else if (field.kind == FieldKind::kList) {
      ordered_json& list = object[field.name] = ordered_json::array();
      for (const Description& item : field.parts()) list.push_back(json_of(item));
    } else if (const FieldValue value = field.get();
               !field.zero_if_missing ||
               (value != FieldValue(0.0) && value != FieldValue(std::vector<double>()))) {
      object[field.name] = stored(field);
    }
  }
  return object;
}

json row_of(const Description& description) {
  json row = json::array();
  for (const Field& field : description) row.push_back(stored(field));
  return row;
}

void read_row(const Description& description, const json& row) {
  std::size_t column = 0;
  for (const Field& field : description) field.set(value_as(field.kind, row.at(column++)));
}

void append_fingerprint(const Description& description, json& array) {
  for (const Field& field : description) {
    if (field.left_out.empty()) array.push_back(json_of(field.fingerprint()));
  }
}

namespace {

FieldValue value_in(const JsonFields& fields, const Field& field) {
  const std::string& name = field.name;
  if (field.kind == FieldKind::kFlag) return fields.flag(name);
  if (field.kind == FieldKind::kWhole) return fields.integer(name);
  if (field.is_number()) {
    const bool infinite = field.infinite_if_null && fields.at(name).is_null();
    return infinite ? std::numeric_limits<double>::infinity() : fields.number(name);
  }
  if (field.kind == FieldKind::kNumbers) return fields.numbers(name, field.count);
  const std::string text = fields.text(name);
  if (field.kind == FieldKind::kText) return text;
  std::string rule = "it must be";
  for (const std::string& word : field.words) {
    if (text == word) return text;
    rule += (word == field.words.front() ? " \"" : " or \"") + word + "\"";
  }
  fields.refuse(name, rule);
}

/// @throw InputError unless a number keeps its limits.
void require_limits(const JsonFields& fields, const Field& field, double value) {
  if (!field.limits.hold(value)) fields.refuse(field.name, "it must be " + field.limits.rule());
}

void read_list(const Field& list, const JsonFields& fields) {
  const json& items = fields.at(list.name);
  if (!items.is_array()) fields.refuse(list.name, "it must be a list");
  list.clear();
  for (std::size_t i = 0; i < items.size(); ++i) {
    read_json(list.append(), fields.item(list.name, i));
  }
}

}  // namespace

void read_json(const Description& description, const JsonFields& fields) {
  for (const Field& field : description) {
    if (!field.needed && !fields.has(field.name)) continue;
    if (field.kind == FieldKind::kTable) {
      read_json(field.parts().front(), fields.object(field.name));
    } else if (field.kind == FieldKind::kList) {
      read_list(field, fields);
    } else {
      const FieldValue value = value_in(fields, field);
      if (field.is_number()) require_limits(fields, field, number_of(value));
      field.set(value);
    }
  }
}

}  // namespace lensforge
