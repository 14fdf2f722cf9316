// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/schema/toml.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/toml_document.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr std::size_t kLongestText = 200;

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

bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; }

bool is_one_line(const std::string& text) {
  if (std::any_of(text.begin(), text.end(), is_control)) return false;
  return text.find_first_not_of(' ') != std::string::npos && text.size() <= kLongestText;
}

// tomlplusplus (3.3) makes a table for each part of a dotted key and destroys them by recursion: a
// key of 100,000 parts overflows the stack. TOML v1.0.0, "Keys", "String".

/// Maximum parts of a dotted key, and maximum depth of brackets.
constexpr int kMaxDepth = 32;

/// Finds nesting that is too deep to parse, skipping strings and comments; the document need not be
/// well-formed.
class NestingScanner {
 public:
  explicit NestingScanner(std::string_view text) : text_(text) {}

  /// "line N: …"; nothing if there is none.
  std::optional<std::string> problem() {
    while (at_ < text_.size()) {
      step(text_[at_]);
      if (parts_ > kMaxDepth) return line_text() + "a key has" + limit_text() + " parts";
      if (depth_ > kMaxDepth) return line_text() + "brackets are nested" + limit_text() + " deep";
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] std::string line_text() const {
    const auto lines = std::count(text_.begin(), text_.begin() + static_cast<long>(at_), '\n');
    return "line " + std::to_string(lines + 1) + ": ";
  }
  static std::string limit_text() { return " more than " + std::to_string(kMaxDepth); }

  void step(char c) {
    if (c == '"' || c == '\'') return skip_string(c);
    if (c == '#') return skip_to("\n");
    ++at_;
    if (c == '.') ++parts_;
    if (c == '\n' || c == '=' || c == ',') parts_ = 1;
    if (c == '[' || c == '{') open();
    if (c == ']' || c == '}') close();
  }

  void open() {
    ++depth_;
    parts_ = 1;
  }
  void close() {
    depth_ = std::max(0, depth_ - 1);
    parts_ = 1;
  }

  void skip_string(char quote) {
    const std::string three(3, quote);
    const bool many_lines = text_.substr(at_).starts_with(three);
    const std::string end = many_lines ? three : std::string(1, quote);
    at_ += end.size();
    while (at_ < text_.size() && !text_.substr(at_).starts_with(end)) {
      if (!many_lines && text_[at_] == '\n') return;  // Not closed: the parser refuses it.
      at_ += quote == '"' && text_[at_] == '\\' ? 2 : 1;
    }
    at_ = std::min(at_ + end.size(), text_.size());
  }

  void skip_to(std::string_view end) { at_ = std::min(text_.find(end, at_), text_.size()); }

  std::string_view text_;
  std::size_t at_ = 0;
  int parts_ = 1;
  int depth_ = 0;
};

}  // namespace

toml::table parse_toml(std::string_view text, const std::string& file) {
  if (text.size() > kMaxTomlBytes) {
    throw InputError(file + ": has " + std::to_string(text.size()) + " bytes: at most 1 MiB");
  }
  if (const auto problem = NestingScanner(text).problem()) throw InputError(file + ": " + *problem);
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

struct TomlFields::Table {
  std::shared_ptr<const toml::table> document;
  const toml::table& table;

  /// Null if the key is missing.
  [[nodiscard]] const toml::node* find(const std::string& key) const { return table.get(key); }
};

TomlFields::TomlFields(std::string_view text, TomlSource source) : source_(std::move(source)) {
  const auto document = std::make_shared<const toml::table>(parse_toml(text, source_.file));
  table_ = std::make_shared<const Table>(Table{document, *document});
}

TomlFields::TomlFields(std::shared_ptr<const Table> table, TomlSource source, std::string path)
    : table_(std::move(table)), source_(std::move(source)), path_(std::move(path)) {}

bool TomlFields::has(const std::string& key) const { return table_->find(key) != nullptr; }

std::string TomlFields::name_of(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

void TomlFields::refuse(const std::string& key, const std::string& rule) const {
  throw InputError(printable_line(source_.file + ": " + name_of(key) + ": " +
                                  shown(table_->find(key)) + ": " + rule));
}

void TomlFields::require(const std::string& key) {
  known_.insert(key);
  if (!has(key)) refuse(key, source_.kind + " needs this key");
}

std::string TomlFields::text(const std::string& key) {
  require(key);
  const auto* value = table_->find(key)->as_string();
  if (value == nullptr) refuse(key, "must be a string");
  if (!is_one_line(value->get())) refuse(key, "must be one line of 1 to 200 bytes, not blank");
  return value->get();
}

std::string TomlFields::text_or(const std::string& key, const std::string& otherwise) {
  known_.insert(key);
  return has(key) ? text(key) : otherwise;
}

std::vector<std::string> TomlFields::texts(const std::string& key) {
  require(key);
  const auto* value = table_->find(key)->as_array();
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

std::string TomlFields::one_of(const std::string& key, const std::vector<std::string>& words) {
  std::string value = text(key);
  if (std::find(words.begin(), words.end(), value) != words.end()) return value;
  refuse(key, "must be one of: " + joined(words, ", "));
}

double TomlFields::number(const std::string& key, const Limits& limits) {
  require(key);
  const toml::node& node = *table_->find(key);
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) refuse(key, "must be a finite number");
  const char* const must = limits.low_excluded ? "must be " : "must be in ";
  if (!limits.hold(*value)) refuse(key, must + limits.rule());
  return *value;
}

double TomlFields::number_or(const std::string& key, const Limits& limits, double otherwise) {
  known_.insert(key);
  return has(key) ? number(key, limits) : otherwise;
}

int TomlFields::whole(const std::string& key, const Limits& limits) {
  require(key);
  if (!table_->find(key)->is_integer()) refuse(key, "must be a whole number");
  return static_cast<int>(number(key, limits));
}

int TomlFields::whole_or(const std::string& key, const Limits& limits, int otherwise) {
  known_.insert(key);
  return has(key) ? whole(key, limits) : otherwise;
}

bool TomlFields::flag(const std::string& key) {
  require(key);
  const auto* value = table_->find(key)->as_boolean();
  if (value == nullptr) refuse(key, "must be true or false");
  return value->get();
}

bool TomlFields::flag_or(const std::string& key, bool otherwise) {
  known_.insert(key);
  return has(key) ? flag(key) : otherwise;
}

TomlFields TomlFields::table(const std::string& key) {
  require(key);
  const auto* value = table_->find(key)->as_table();
  if (value == nullptr) refuse(key, "must be a table");
  return {std::make_shared<const Table>(Table{table_->document, *value}), source_, name_of(key)};
}

std::vector<TomlFields> TomlFields::tables(const std::string& key) {
  require(key);
  const auto* value = table_->find(key)->as_array();
  if (value == nullptr || value->empty()) refuse(key, "must be an array of at least one table");
  std::vector<TomlFields> all;
  for (const toml::node& entry : *value) {
    if (!entry.is_table()) refuse(key, "must be an array of at least one table");
    const auto table = std::make_shared<const Table>(Table{table_->document, *entry.as_table()});
    all.push_back({table, source_, name_of(key) + "[" + std::to_string(all.size()) + "]"});
  }
  return all;
}

std::vector<std::string> TomlFields::keys() const {
  std::vector<std::string> all;
  for (const auto& [key, value] : table_->table) all.emplace_back(key.str());
  return all;
}

void TomlFields::finish() const {
  for (const std::string& key : keys()) {
    if (known_.contains(key)) continue;
    const std::string meant = nearest_word(key, known_);
    refuse(key, source_.kind + ": unknown key" + (meant.empty() ? "" : "; use " + meant));
  }
}

namespace {

/// The value of a field in a table that has it.
FieldValue value_in(TomlFields& fields, const Field& field) {
  switch (field.kind) {
    case FieldKind::kFlag:
      return fields.flag(field.name);
    case FieldKind::kWhole:
      return fields.whole(field.name, field.limits);
    case FieldKind::kWord:
      return fields.one_of(field.name, field.words);
    case FieldKind::kText:
      return fields.text(field.name);
    default:
      return fields.number(field.name, field.limits);
  }
}

void read_list(const Field& list, TomlFields& fields) {
  list.clear();
  for (TomlFields& item : fields.tables(list.name)) read_toml(list.append(), std::move(item));
}

std::string toml_string(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + "\"";
}

std::string value_text(const FieldValue& value) {
  if (const auto* const flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* const whole = std::get_if<int>(&value)) return std::to_string(*whole);
  if (const auto* const number = std::get_if<double>(&value)) return shortest_text(*number);
  return toml_string(std::get<std::string>(value));
}

/// @param prefix  path of the table, with a dot behind it.
std::string tables_text(const Description& description, const std::string& prefix) {
  std::string text;
  for (const Field& field : description) {
    if (field.parts) {
      const bool list = field.kind == FieldKind::kList;
      std::string introduction = field.help.empty() ? "" : "# " + field.help + "\n";
      for (const Description& part : field.parts()) {
        text += '\n';
        text += std::exchange(introduction, "");
        text += (list ? "[[" : "[") + prefix + field.name + (list ? "]]\n" : "]\n");
        text += tables_text(part, prefix + field.name + ".");
      }
      continue;
    }
    const FieldValue value = field.get();
    if (field.zero_if_missing && !(number_of(value) > 0.0)) {
      text += "# " + field.name + " =  # " + field.help + "\n";
      continue;
    }
    text += field.name + " = " + value_text(value);
    text += (field.help.empty() ? "" : "  # " + field.help) + "\n";
  }
  return text;
}

/// @param where  file, and path of the table with a dot behind it.
void require_limits_at(const Description& description, const std::string& where) {
  for (const Field& field : description) {
    if (field.kind == FieldKind::kTable) {
      require_limits_at(field.parts().front(), where + field.name + ".");
    } else if (field.kind == FieldKind::kList) {
      const std::vector<Description> items = field.parts();
      for (std::size_t i = 0; i < items.size(); ++i) {
        require_limits_at(items[i], where + field.name + "[" + std::to_string(i) + "].");
      }
    }
    if (!field.is_number()) continue;
    const double value = number_of(field.get());
    if (field.limits.hold(value) || (field.zero_if_missing && value == 0.0)) continue;
    const std::string named = where + field.name + ": " + shortest_text(value);
    if (field.limits.low_excluded) throw InputError(named + ": must be " + field.limits.rule());
    throw InputError(named + ": must be in " + shortest_text(field.limits.low) + " to " +
                     shortest_text(field.limits.high));
  }
}

}  // namespace

void read_toml(const Description& description, TomlFields fields) {
  for (const Field& field : description) {
    if (field.kind == FieldKind::kList) {
      if (fields.has(field.name)) read_list(field, fields);
    } else if (field.kind == FieldKind::kTable) {
      if (fields.has(field.name)) read_toml(field.parts().front(), fields.table(field.name));
    } else if (field.needed || fields.has(field.name)) {
      field.set(value_in(fields, field));
    } else {
      fields.allow(field.name);
    }
  }
  fields.finish();
}

std::string toml_text(const Description& description) { return tables_text(description, ""); }

void require_toml_limits(const Description& description, const std::string& file) {
  require_limits_at(description, file + ": ");
}

}  // namespace lensforge
