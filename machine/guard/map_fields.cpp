// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/map_fields.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/error.h"

namespace lensforge {
namespace {

constexpr std::size_t kLongestText = 200;

/// The value as the file has it; a table or an array only by its kind.
std::string shown(const toml::node* value) {
  if (value == nullptr) return "missing";
  if (value->is_table()) return "a table";
  if (value->is_array()) return "an array";
  std::ostringstream text;
  value->visit([&text](const auto& node) {
    if constexpr (!toml::is_table<decltype(node)> && !toml::is_array<decltype(node)>) text << node;
  });
  return text.str().substr(0, kLongestText);
}

std::string number_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string range_text(const NumberRule& rule) {
  return number_text(rule.least) + " to " + number_text(rule.most);
}

bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; }

bool is_one_line(const std::string& text) {
  if (std::any_of(text.begin(), text.end(), is_control)) return false;
  return text.find_first_not_of(' ') != std::string::npos && text.size() <= kLongestText;
}

}  // namespace

std::string one_line(std::string text) {
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

std::string MapFields::name_of(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

void MapFields::refuse(const std::string& key, const std::string& rule) const {
  throw InputError(
      one_line(file_ + ": " + name_of(key) + ": " + shown(table_.get(key)) + ": " + rule));
}

const toml::node& MapFields::required(const std::string& key) {
  known_.insert(key);
  const toml::node* value = table_.get(key);
  if (value == nullptr) refuse(key, "a register map needs this key");
  return *value;
}

std::string MapFields::text(const std::string& key) {
  const auto* value = required(key).as_string();
  if (value == nullptr) refuse(key, "must be a string");
  if (!is_one_line(value->get())) refuse(key, "must be one line of 1 to 200 bytes, not blank");
  return value->get();
}

std::string MapFields::one_of(const std::string& key,
                              std::initializer_list<std::string_view> words) {
  std::string value = text(key);
  std::string list;
  for (const std::string_view word : words) {
    if (value == word) return value;
    list += (list.empty() ? "" : ", ") + std::string(word);
  }
  refuse(key, "must be one of: " + list);
}

double MapFields::number(const NumberRule& rule) {
  const toml::node& node = required(rule.key);
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) refuse(rule.key, "must be a finite number");
  if (*value < rule.least || *value > rule.most) {
    refuse(rule.key, "must be in " + range_text(rule));
  }
  return *value;
}

double MapFields::number_or(const NumberRule& rule, double otherwise) {
  known_.insert(rule.key);
  return has(rule.key) ? number(rule) : otherwise;
}

int MapFields::whole(const NumberRule& rule) {
  if (!required(rule.key).is_integer()) refuse(rule.key, "must be a whole number");
  return static_cast<int>(number(rule));
}

int MapFields::whole_or(const NumberRule& rule, int otherwise) {
  known_.insert(rule.key);
  return has(rule.key) ? whole(rule) : otherwise;
}

bool MapFields::flag_or(const std::string& key, bool otherwise) {
  known_.insert(key);
  if (!has(key)) return otherwise;
  const auto* value = required(key).as_boolean();
  if (value == nullptr) refuse(key, "must be true or false");
  return value->get();
}

MapFields MapFields::table(const std::string& key) {
  const auto* value = required(key).as_table();
  if (value == nullptr) refuse(key, "must be a table");
  return {*value, file_, name_of(key)};
}

std::vector<MapFields> MapFields::tables(const std::string& key) {
  const auto* value = required(key).as_array();
  if (value == nullptr || value->empty()) refuse(key, "must be an array of tables, one at least");
  std::vector<MapFields> all;
  for (const toml::node& entry : *value) {
    if (!entry.is_table()) refuse(key, "must be an array of tables, one at least");
    all.emplace_back(*entry.as_table(), file_,
                     name_of(key) + "[" + std::to_string(all.size()) + "]");
  }
  return all;
}

std::vector<std::string> MapFields::keys() const {
  std::vector<std::string> all;
  for (const auto& [key, value] : table_) all.emplace_back(key.str());
  return all;
}

void MapFields::finish() const {
  for (const std::string& key : keys()) {
    if (!known_.contains(key)) refuse(key, "a register map has no such key here");
  }
}

}  // namespace lensforge
