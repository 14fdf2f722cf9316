// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>

namespace lensforge {

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
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] double number(const std::string& name) const;
  [[nodiscard]] int integer(const std::string& name) const;
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

}  // namespace lensforge
