// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <charconv>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Numbers as text, with a point in any locale.
namespace lensforge {

/// The shortest text that reads back as the same number: "0.1", "23000", "1e-07".
inline std::string shortest_text(double value) {
  char text[32];  // The longest is -2.2250738585072014e-308.
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// A number to at most `digits` significant digits, as printf's %g writes it. @pre digits ≤ 17
inline std::string number_text(double value, int digits = 6) {
  char text[32];
  return {text,
          std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits).ptr};
}

/// A number with a fixed count of decimals: no exponent, no negative zero.
inline std::string decimal_text(double value, int decimals) {
  char digits[400];  // The largest double has 309 digits before the point.
  const auto [end, error] =
      std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals);
  std::string text(digits, error == std::errc() ? end : digits);
  const bool zero = text.find_first_of("123456789") == std::string::npos;
  if (zero && text.starts_with('-') && text.find('0') != std::string::npos) text.erase(0, 1);
  return text;
}

/// decimal_text() without zeros behind its point: "0.3", "12".
inline std::string trimmed_decimal(double value, int decimals) {
  std::string text = decimal_text(value, decimals);
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

/// A fact and its value; text.
struct NamedText {
  std::string name;
  std::string value;
};

/// Reads numbers that are separated by commas, such as "50,50,-600"; spaces around them are
/// allowed.
/// @param name  name of the value in the error, e.g. "--image-offset".
/// @throw InputError unless there are `count` finite numbers.
std::vector<double> parse_numbers(std::string_view text, const std::string& name, int count);

/// Reads a length such as "100", "100mm", "10cm", "0.1m", "4in" or "250um", spaces allowed before
/// the unit; millimetres without one.
/// @param name  name of the value in the error, e.g. "--width".
/// @return millimetres. @throw InputError unless it is a finite number with a known unit or none.
double parse_length_mm(std::string_view text, const std::string& name);

/// The shortest text from which parse_numbers() reads the same numbers.
std::string numbers_text(std::span<const double> numbers);

}  // namespace lensforge
