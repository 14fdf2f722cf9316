// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <initializer_list>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// Rule for a number in a TOML document: its key, minimum and maximum.
struct NumberRule {
  std::string key;
  double least;
  double most;
};

/// Maximum size of a TOML document.
inline constexpr std::size_t kMaxTomlBytes = std::size_t{1} << 20U;

/// A document's file and kind, for messages.
struct TomlSource {
  std::string file;  ///< As given by the user.
  std::string kind;  ///< With its article: "a register map".
};

/// @throw InputError naming file and line if `text` is not TOML, exceeds 1 MiB, or has a key of
///        more than 32 parts or brackets nested more than 32 deep.
toml::table parse_toml(std::string_view text, const std::string& file);

/// The text of a small file. @throw InputError naming the file and why it cannot be read, or that
/// it exceeds 1 MiB.
std::string read_toml_file(const std::filesystem::path& path, const std::string& kind);

/// A table of a TOML document, read strictly: every getter records its key, and finish() refuses
/// all other keys. All throw InputError naming file, key, value and rule.
class TomlFields {
 public:
  /// @param table  must outlive the fields.
  TomlFields(const toml::table& table, TomlSource source, std::string path = {})
      : table_(table), source_(std::move(source)), path_(std::move(path)) {}

  [[nodiscard]] bool has(const std::string& key) const { return table_.contains(key); }
  /// A text: not blank, one line, at most 200 bytes.
  [[nodiscard]] std::string text(const std::string& key);
  /// text(), or `otherwise` if the key is missing.
  [[nodiscard]] std::string text_or(const std::string& key, const std::string& otherwise);
  /// An array of strings, each with the rules of text(); it may be empty.
  [[nodiscard]] std::vector<std::string> texts(const std::string& key);
  [[nodiscard]] std::string one_of(const std::string& key,
                                   std::initializer_list<std::string_view> words);
  [[nodiscard]] double number(const NumberRule& rule);
  [[nodiscard]] double number_or(const NumberRule& rule, double otherwise);
  [[nodiscard]] int whole(const NumberRule& rule);
  [[nodiscard]] int whole_or(const NumberRule& rule, int otherwise);
  [[nodiscard]] bool flag(const std::string& key);
  [[nodiscard]] bool flag_or(const std::string& key, bool otherwise);
  [[nodiscard]] TomlFields table(const std::string& key);
  /// The tables of an array, which must exist and not be empty.
  [[nodiscard]] std::vector<TomlFields> tables(const std::string& key);
  /// The keys of this table.
  [[nodiscard]] std::vector<std::string> keys() const;
  /// @throw InputError for a key that no getter has read.
  void finish() const;

  /// "spindle.status.speed" for the key "speed" of this table.
  [[nodiscard]] std::string name_of(const std::string& key) const;
  /// Path of this table in the document, e.g. "spindle.status".
  [[nodiscard]] const std::string& path() const { return path_; }
  /// @throw InputError: with file, key, value and rule.
  [[noreturn]] void refuse(const std::string& key, const std::string& rule) const;

 private:
  const toml::node& required(const std::string& key);

  const toml::table& table_;
  TomlSource source_;
  std::string path_;
  std::set<std::string> known_;
};

}  // namespace lensforge
