// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/description.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <regex>

#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {

bool Limits::hold(double value) const {
  if (or_zero && value == 0.0) return true;
  return (low_excluded ? value > low : value >= low) && value <= high;
}

std::string Limits::rule() const {
  const std::string zero = or_zero ? "0, or " : "";
  if (std::isinf(high)) return zero + number_text(low) + " or more";
  return low_excluded ? zero + "above " + number_text(low) + ", at most " + number_text(high)
                      : zero + number_text(low) + " to " + number_text(high);
}

double number_of(const FieldValue& value) {
  const auto* const whole = std::get_if<int>(&value);
  return whole != nullptr ? *whole : std::get<double>(value);
}

void FieldSpec::require(const std::string& text, double value) const {
  if (limits.hold(value)) return;
  throw InputError(name + " " + text + ": must be " + limits.rule() +
                   (unit.empty() ? "" : " " + unit));
}

void FieldSpec::require_word(const std::string& text) const {
  if (std::find(words.begin(), words.end(), text) != words.end()) return;
  throw InputError(name + " " + text + ": must be one of " + joined(words, ", "));
}

namespace {

template <class Value>
Field plain(FieldSpec spec, const Place<Value>& at) {
  return {std::move(spec), [at] { return FieldValue(at()); },
          [at](const FieldValue& value) { at() = std::get<Value>(value); }};
}

}  // namespace

Field& Description::flag(const std::string& name, const Place<bool>& at, const std::string& help) {
  return add(plain({.name = name, .kind = FieldKind::kFlag, .help = help}, at));
}

Field& Description::without(const std::string& name, const Place<bool>& at,
                            const std::string& help) {
  Field& field = flag(name, at, help);
  field.get = [at] { return FieldValue(!at()); };
  field.set = [at](const FieldValue& value) { at() = !std::get<bool>(value); };
  field.stored = [at] { return FieldValue(at()); };
  return field;
}

Field& Description::whole(const std::string& name, const Place<int>& at, const Limits& limits,
                          const std::string& help) {
  return add(plain({.name = name, .kind = FieldKind::kWhole, .help = help, .limits = limits}, at));
}

Field& Description::whole(const std::string& name, std::int64_t& value, const Limits& limits,
                          const std::string& help) {
  return add({{.name = name, .kind = FieldKind::kWhole, .help = help, .limits = limits},
              [&value] { return static_cast<int>(value); },
              [&value](const FieldValue& given) { value = std::get<int>(given); }});
}

Field& Description::number(const std::string& name, const Place<double>& at, const Limits& limits,
                           const std::string& unit, const std::string& help) {
  return add(plain({name, FieldKind::kNumber, help, limits, unit}, at));
}

Field& Description::length(const std::string& name, const Place<double>& at, const Limits& limits,
                           const std::string& help) {
  return add(plain({name, FieldKind::kLength, help, limits, "mm"}, at));
}

Field& Description::text(const std::string& name, const Place<std::string>& at,
                         const std::string& unit, const std::string& help) {
  return add(plain({.name = name, .help = help, .unit = unit}, at));
}

Field& Description::text(const FieldSpec& spec, const std::function<std::string()>& get,
                         const std::function<void(const std::string&)>& set) {
  return add({spec, get, [set](const FieldValue& value) { set(std::get<std::string>(value)); }});
}

Field& Description::texts(const std::string& name, const Place<std::vector<std::string>>& at,
                          const std::string& unit, const std::string& help) {
  return add(plain({.name = name, .help = help, .unit = unit}, at));
}

Field& Description::like(const Field& other, const std::string& name, const std::string& help) {
  Field field = other;
  field.name = name;
  field.help = help;
  field.needed = field.zero_if_missing = false;
  if (field.kind == FieldKind::kWord) {
    field.set = [spec = FieldSpec(field), set = other.set](const FieldValue& value) {
      spec.require_word(std::get<std::string>(value));
      set(value);
    };
  }
  return add(std::move(field));
}

Field& Description::add(Field field) { return fields_.emplace_back(std::move(field)); }

void Description::add(const Description& other) {
  fields_.insert(fields_.end(), other.fields_.begin(), other.fields_.end());
  owned_.insert(owned_.end(), other.owned_.begin(), other.owned_.end());
}

Field Description::at(std::string_view path) const {
  const std::size_t dot = path.find('.');
  const std::string_view name = path.substr(0, dot);
  const auto found = std::find_if(begin(), end(), [&](const Field& f) { return f.name == name; });
  LF_CHECK(found != end(), std::string(path));
  if (dot == std::string_view::npos) return *found;
  const std::string_view rest = path.substr(dot + 1);
  if (found->kind != FieldKind::kList) return found->parts().front().at(rest);
  Field field = found->example().at(rest);
  field.get = field.stored = nullptr;
  field.set = nullptr;
  return field;
}

Description Description::only(const std::set<std::string>& names) const {
  Description some = *this;
  std::erase_if(some.fields_, [&](const Field& field) { return !names.contains(field.name); });
  return some;
}

Description Description::except(const std::set<std::string>& names) const {
  Description some = *this;
  std::erase_if(some.fields_, [&](const Field& field) { return names.contains(field.name); });
  return some;
}

void Description::require_limits() const {
  for (const Field& field : fields_) {
    if (!field.is_number()) continue;
    const FieldValue value = field.get();
    if (std::holds_alternative<std::monostate>(value)) continue;
    field.require(number_text(number_of(value)), number_of(value));
  }
}

namespace {

template <class Value>
Value parsed(const std::string& name, const std::string& text, const char* kind) {
  Value value{};
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped != end) {
    throw InputError(name + " " + text + ": must be " + kind);
  }
  return value;
}

/// Text for a manual page: no character begins a request or an escape.
std::string manual_text(const std::string& text) {
  std::string safe;
  for (const char c : text) safe += c == '\\' ? std::string("\\e") : std::string(1, c);
  return safe.starts_with('.') || safe.starts_with('\'') ? "\\&" + safe : safe;
}

}  // namespace

FieldValue value_of(const FieldSpec& option, const std::string& text) {
  const auto checked = [&](auto value) {
    option.require(text, static_cast<double>(value));
    return FieldValue(value);
  };
  switch (option.kind) {
    case FieldKind::kWhole:
      return checked(parsed<int>(option.name, text, "a whole number"));
    case FieldKind::kNumber:
      return checked(parsed<double>(option.name, text, "a number"));
    case FieldKind::kLength:
      return checked(parse_length_mm(text, option.name));
    case FieldKind::kWord:
      option.require_word(text);
      return text;
    case FieldKind::kText:
      if (text.empty()) throw InputError(option.name + ": must not be empty");
      return text;
    default:
      return text == "true";
  }
}

std::string value_text(const FieldValue& value) {
  if (const auto* const flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* const whole = std::get_if<int>(&value)) return std::to_string(*whole);
  if (const auto* const number = std::get_if<double>(&value)) return number_text(*number);
  if (const auto* const text = std::get_if<std::string>(&value)) return *text;
  const auto* const words = std::get_if<std::vector<std::string>>(&value);
  return words != nullptr ? joined(*words, " ") : "";
}

std::string placeholder(const FieldSpec& option) {
  switch (option.kind) {
    case FieldKind::kWhole:
      return "N";
    case FieldKind::kNumber:
      return "NUMBER";
    case FieldKind::kLength:
      return "MM";
    case FieldKind::kWord:
      return joined(option.words, "|");
    case FieldKind::kText:
      return option.unit;
    default:
      return {};
  }
}

std::string help_text(const FieldSpec& option) {
  if (!option.is_number()) return option.help;
  return option.help + "; " + (option.unit.empty() ? "" : option.unit + ", ") +
         option.limits.rule();
}

std::string manual_item(const Field& option) {
  const std::string type = placeholder(option);
  std::string text = ".It Fl " + option.name.substr(1) + (type.empty() ? "" : " Ar " + type) + "\n";
  text += manual_text(help_text(option)) + ".\n";
  const std::string value = value_text(option.get());
  const bool shown = option.kind != FieldKind::kFlag && !value.empty();
  return shown ? text + "Default: " + value + ".\n" : text;
}

std::string keyword_of(const std::string& option) {
  std::string name = option.substr(option.find_first_not_of('-'));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string python_type(const FieldSpec& option) {
  switch (option.kind) {
    case FieldKind::kFlag:
      return "bool";
    case FieldKind::kWhole:
      return "int";
    case FieldKind::kNumber:
      return "float";
    case FieldKind::kLength:
      return "float, mm, or a text with its unit";
    default:
      return "str";
  }
}

std::string docstring_line(const FieldSpec& option, const std::string& initial) {
  std::string text = "\n  " + keyword_of(option.name) + " (" + python_type(option) + "): ";
  text += in_keywords(option.help);
  if (option.is_number()) text += "; " + option.limits.rule();
  if (!option.words.empty()) text += "; " + joined(option.words, ", ");
  if (!initial.empty()) text += "; default " + initial;
  return text;
}

std::string in_keywords(const std::string& message) {
  // Behind other characters, "--" is a part of a file's name.
  static const std::regex option(R"((^|[\s"'(,;|])--([a-z][a-z0-9-]*))");
  std::string text;
  auto rest = message.begin();
  for (std::sregex_iterator found(message.begin(), message.end(), option), none; found != none;
       ++found) {
    text.append(rest, found->prefix().second).append((*found)[1]);
    text += keyword_of((*found)[2]);
    rest = (*found)[0].second;
  }
  return text.append(rest, message.end());
}

}  // namespace lensforge
