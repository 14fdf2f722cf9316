// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/schema/description.h"

namespace lensforge {

/// Maximum nesting depth of a JSON document.
inline constexpr int kMaxJsonDepth = 64;

/// Parses a JSON document strictly.
/// @param name  the file's name in messages.
/// @throw InputError "name: is no JSON: …" naming the byte, or that a number is beyond the range of
///        doubles, that a name is repeated in an object or that it is nested too deeply; in short
///        words of our own, never the library's.
nlohmann::json parse_json(std::string_view text, const std::string& name);

/// A field's value; null if it has none.
nlohmann::json json_of(const FieldValue& value);

/// Typed access to the fields of a JSON object; every refusal is an InputError that names the file
/// and the field, e.g. "lens.json: field 'source.type' is missing". Fields that are not read are
/// ignored.
class JsonFields {
 public:
  /// @param file    the file's name in messages.
  /// @param prefix  prefix of field names in messages, e.g. "source.".
  /// @pre `object` outlives this. @throw InputError if it is no JSON object.
  JsonFields(const nlohmann::json& object, std::string file, std::string prefix = "");

  [[nodiscard]] bool has(const std::string& name) const;
  [[nodiscard]] const nlohmann::json& at(const std::string& name) const;
  [[nodiscard]] JsonFields object(const std::string& name) const;
  /// An object in a list. @pre the list has so many.
  [[nodiscard]] JsonFields item(const std::string& name, std::size_t index) const;
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] double number(const std::string& name) const;
  [[nodiscard]] int integer(const std::string& name) const;
  [[nodiscard]] bool flag(const std::string& name) const;
  /// @param count  of numbers, 2 or 3; 0: any.
  [[nodiscard]] std::vector<double> numbers(const std::string& name, std::size_t count = 0) const;
  [[nodiscard]] Eigen::Vector2d number_pair(const std::string& name) const;
  [[nodiscard]] Eigen::Vector3d number_triple(const std::string& name) const;
  [[nodiscard]] Eigen::Vector2i integer_pair(const std::string& name) const;

  /// @throw InputError "file: field 'name' is VALUE: rule".
  [[noreturn]] void refuse(const std::string& name, const std::string& rule) const;

 private:
  const nlohmann::json* object_;
  std::string file_;
  std::string prefix_;
};

/// A described object, its fields in the description's order. Numbers and lists that a missing
/// field stands for are left out; numbers that null stands for are null.
nlohmann::ordered_json json_of(const Description& description);

/// Reads it back: a field that is not needed keeps its value if it is missing. @throw InputError
/// naming file, field, value and rule.
void read_json(const Description& description, const JsonFields& fields);

/// The value that a field's word stands for.
template <class Value>
Value word_in(const JsonFields& fields, const std::string& name, const Choices<Value>& choices) {
  Value value{};
  Description description;
  description.word(name, value, choices, "").needed = true;
  read_json(description, fields);
  return value;
}

/// The values of an object's fields as an array, for a row of a table.
nlohmann::json row_of(const Description& description);

/// Reads such an array back; its values are not checked against limits. @throw json::exception if
/// one is missing or of another type.
void read_row(const Description& description, const nlohmann::json& row);

/// Appends the values that a fingerprint holds to an array.
void append_fingerprint(const Description& description, nlohmann::json& array);

}  // namespace lensforge
