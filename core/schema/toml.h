// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/schema/description.h"

namespace lensforge {

/// Maximum size of a TOML document.
inline constexpr std::size_t kMaxTomlBytes = std::size_t{1} << 20U;

/// A document's file and kind, for messages.
struct TomlSource {
  std::string file;  ///< As given by the user.
  std::string kind;  ///< With its article: "a register map".
};

/// The text of a small file. @throw InputError naming the file and why it cannot be read, or that
/// it exceeds 1 MiB.
std::string read_toml_file(const std::filesystem::path& path, const std::string& kind);

/// A table of a TOML document, read strictly: every getter records its key, and finish() refuses
/// all other keys. All throw InputError naming file, key, value and rule.
class TomlFields {
 public:
  /// Parses a document. @throw InputError as parse_toml().
  TomlFields(std::string_view text, TomlSource source);

  [[nodiscard]] bool has(const std::string& key) const;
  /// A text: not blank, one line, at most 200 bytes.
  [[nodiscard]] std::string text(const std::string& key);
  /// text(), or `otherwise` if the key is missing.
  [[nodiscard]] std::string text_or(const std::string& key, const std::string& otherwise);
  /// An array of strings, each with the rules of text(); it may be empty.
  [[nodiscard]] std::vector<std::string> texts(const std::string& key);
  [[nodiscard]] std::string one_of(const std::string& key, const std::vector<std::string>& words);
  [[nodiscard]] double number(const std::string& key, const Limits& limits);
  [[nodiscard]] double number_or(const std::string& key, const Limits& limits, double otherwise);
  [[nodiscard]] int whole(const std::string& key, const Limits& limits);
  [[nodiscard]] int whole_or(const std::string& key, const Limits& limits, int otherwise);
  [[nodiscard]] bool flag(const std::string& key);
  [[nodiscard]] bool flag_or(const std::string& key, bool otherwise);
  [[nodiscard]] TomlFields table(const std::string& key);
  /// The tables of an array, which must exist and not be empty.
  [[nodiscard]] std::vector<TomlFields> tables(const std::string& key);
  /// Names a key that may be missing, for finish().
  void allow(const std::string& key) { known_.insert(key); }
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
  struct Table;  ///< A table of the document, which all of its fields share.

  TomlFields(std::shared_ptr<const Table> table, TomlSource source, std::string path);
  /// @throw InputError if the key is missing.
  void require(const std::string& key);

  std::shared_ptr<const Table> table_;
  TomlSource source_;
  std::string path_;
  std::set<std::string> known_;
};

/// Reads a described object: a missing key keeps its value, a list replaces the object's as a
/// whole. Then finishes the fields. @throw InputError naming file, key, value and rule.
void read_toml(const Description& description, TomlFields fields);

/// The object as TOML, each key with its help as a comment: read_toml() gives the same object.
std::string toml_text(const Description& description);

/// @throw InputError naming file, key, value and rule if a number is outside its limits.
void require_toml_limits(const Description& description, const std::string& file);

}  // namespace lensforge
