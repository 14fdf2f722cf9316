// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/toml_fields.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/number_text.h"
#include "core/text/printable.h"
#include "core/text/toml_nesting.h"

namespace lensforge {
namespace {

constexpr std::size_t kLongestText = 200;
constexpr std::size_t kMostEdits = 2;  ///< Maximum for a mistyped key: two letters swapped.

/// The value as in the file; for a table or array only its kind.
std::string shown(const toml::node* value) {
  if (value == nullptr) return "missing";
  if (value->is_table()) return "a table";
  if (value->is_array()) return "an array";
  if (const auto* number = value->as_floating_point()) return shortest_text(number->get());
  std::ostringstream text;
  value->visit([&text](const auto& node) {
    if constexpr (!toml::is_table<decltype(node)> && !toml::is_array<decltype(node)>) text << node;
  });
  return printable_line(text.str(), kLongestText);
}

std::string range_text(const NumberRule& rule) {
  return number_text(rule.least) + " to " + number_text(rule.most);
}

/// Insertions, deletions and replacements that turn one text into the other (Levenshtein).
std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t before = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = before + (a[i - 1] == b[j - 1] ? 0 : 1);
      before = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, replaced}));
    }
  }
  return row.back();
}

/// The known key that was most likely meant; empty if none is near.
std::string likely_key(const std::string& key, const std::set<std::string>& known) {
  std::string likely;
  std::size_t least = kMostEdits + 1;
  for (const std::string& candidate : known) {
    if (key.size() > candidate.size() + kMostEdits) continue;
    const std::size_t edits = edits_between(key, candidate);
    if (edits >= least || edits >= candidate.size()) continue;
    likely = candidate;
    least = edits;
  }
  return likely;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; }

bool is_one_line(const std::string& text) {
  if (std::any_of(text.begin(), text.end(), is_control)) return false;
  return text.find_first_not_of(' ') != std::string::npos && text.size() <= kLongestText;
}

}  // namespace

toml::table parse_toml(std::string_view text, const std::string& file) {
  if (text.size() > kMaxTomlBytes) {
    throw InputError(file + ": has " + std::to_string(text.size()) + " bytes: at most 1 MiB");
  }
  if (const auto problem = toml_nesting_problem(text)) throw InputError(file + ": " + *problem);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& e) {
    throw InputError(printable_line(file + ": line " + std::to_string(e.source().begin.line) +
                                    ": not TOML: " + std::string(e.description())));
  }
}

std::string read_toml_file(const std::filesystem::path& path, const std::string& kind) {
  require_regular_file(path);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > kMaxTomlBytes) {
    throw InputError(path.string() + ": " + std::to_string(size) + " bytes: " + kind +
                     " has at most 1 MiB");
  }
  return read_whole_file(path, kMaxTomlBytes);
}

std::string TomlFields::name_of(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

void TomlFields::refuse(const std::string& key, const std::string& rule) const {
  throw InputError(printable_line(source_.file + ": " + name_of(key) + ": " +
                                  shown(table_.get(key)) + ": " + rule));
}

const toml::node& TomlFields::required(const std::string& key) {
  known_.insert(key);
  const toml::node* value = table_.get(key);
  if (value == nullptr) refuse(key, source_.kind + " needs this key");
  return *value;
}

std::string TomlFields::text(const std::string& key) {
  const auto* value = required(key).as_string();
  if (value == nullptr) refuse(key, "must be a string");
  if (!is_one_line(value->get())) refuse(key, "must be one line of 1 to 200 bytes, not blank");
  return value->get();
}

std::string TomlFields::text_or(const std::string& key, const std::string& otherwise) {
  known_.insert(key);
  return has(key) ? text(key) : otherwise;
}

std::vector<std::string> TomlFields::texts(const std::string& key) {
  const auto* value = required(key).as_array();
  if (value == nullptr) refuse(key, "must be an array of strings");
  std::vector<std::string> all;
  for (const toml::node& entry : *value) {
    const auto* line = entry.as_string();
    if (line == nullptr) refuse(key, "must be an array of strings");
    if (!is_one_line(line->get())) refuse(key, "must hold lines of 1 to 200 bytes, not blank");
    all.push_back(line->get());
  }
  return all;
}

std::string TomlFields::one_of(const std::string& key,
                               std::initializer_list<std::string_view> words) {
  std::string value = text(key);
  std::string list;
  for (const std::string_view word : words) {
    if (value == word) return value;
    list += (list.empty() ? "" : ", ") + std::string(word);
  }
  refuse(key, "must be one of: " + list);
}

double TomlFields::number(const NumberRule& rule) {
  const toml::node& node = required(rule.key);
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) refuse(rule.key, "must be a finite number");
  if (*value < rule.least || *value > rule.most) {
    refuse(rule.key, "must be in " + range_text(rule));
  }
  return *value;
}

double TomlFields::number_or(const NumberRule& rule, double otherwise) {
  known_.insert(rule.key);
  return has(rule.key) ? number(rule) : otherwise;
}

int TomlFields::whole(const NumberRule& rule) {
  if (!required(rule.key).is_integer()) refuse(rule.key, "must be a whole number");
  return static_cast<int>(number(rule));
}

int TomlFields::whole_or(const NumberRule& rule, int otherwise) {
  known_.insert(rule.key);
  return has(rule.key) ? whole(rule) : otherwise;
}

bool TomlFields::flag(const std::string& key) {
  const auto* value = required(key).as_boolean();
  if (value == nullptr) refuse(key, "must be true or false");
  return value->get();
}

bool TomlFields::flag_or(const std::string& key, bool otherwise) {
  known_.insert(key);
  return has(key) ? flag(key) : otherwise;
}

TomlFields TomlFields::table(const std::string& key) {
  const auto* value = required(key).as_table();
  if (value == nullptr) refuse(key, "must be a table");
  return {*value, source_, name_of(key)};
}

std::vector<TomlFields> TomlFields::tables(const std::string& key) {
  const auto* value = required(key).as_array();
  if (value == nullptr || value->empty()) refuse(key, "must be an array of at least one table");
  std::vector<TomlFields> all;
  for (const toml::node& entry : *value) {
    if (!entry.is_table()) refuse(key, "must be an array of at least one table");
    all.emplace_back(*entry.as_table(), source_,
                     name_of(key) + "[" + std::to_string(all.size()) + "]");
  }
  return all;
}

std::vector<std::string> TomlFields::keys() const {
  std::vector<std::string> all;
  for (const auto& [key, value] : table_) all.emplace_back(key.str());
  return all;
}

void TomlFields::finish() const {
  for (const std::string& key : keys()) {
    if (known_.contains(key)) continue;
    const std::string meant = likely_key(key, known_);
    refuse(key, source_.kind + ": unknown key" + (meant.empty() ? "" : "; use " + meant));
  }
}

}  // namespace lensforge
