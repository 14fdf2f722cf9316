// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

/// Data for a page's script.
namespace lensforge {

/// JSON as it may stand inside a script element: without any "<".
std::string script_json(const nlohmann::json& value);

/// A script element that holds data, for the script to look up by its id.
/// @param type  MIME type. @param text  without any "<".
std::string data_element(std::string_view id, std::string_view type, std::string_view text);

/// Numbers as whole numbers of a few bytes, little-endian, 0 … 2^(8 bytes) − 1 for low … high: off
/// by half a step at most.
class PackedNumbers {
 public:
  /// @param bytes  of a number, 1 … 3.
  explicit PackedNumbers(int bytes) : bytes_(bytes) {}

  /// Takes a number, or the bound that it is beyond. @return what will be read back.
  double add(double value, double low, double high);
  /// All of them in base 64.
  [[nodiscard]] std::string text() const;

 private:
  int bytes_;
  std::vector<unsigned char> packed_;
};

}  // namespace lensforge
