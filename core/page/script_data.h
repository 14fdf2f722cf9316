// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

/// Data for a page's script.
namespace lensforge {

/// JSON for use inside a script element: without any "<".
std::string script_json(const nlohmann::json& value);

/// A script element that holds data, which a script finds by its id.
/// @param type  MIME type. @param text  without any "<".
std::string data_element(std::string_view id, std::string_view type, std::string_view text);

/// Numbers packed into little-endian integers of a few bytes, 0 … 2^(8 bytes) − 1 for low … high.
/// Error at most half a step.
class PackedNumbers {
 public:
  /// @param bytes  per number, 1 … 3.
  explicit PackedNumbers(int bytes) : bytes_(bytes) {}

  /// Adds a number, clamped to its bounds. @return the value that is read back.
  double add(double value, double low, double high);
  /// All numbers in base 64.
  [[nodiscard]] std::string text() const;

 private:
  int bytes_;
  std::vector<unsigned char> packed_;
};

}  // namespace lensforge
