// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/option_text.h"

#include <algorithm>
#include <charconv>
#include <regex>

#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
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
