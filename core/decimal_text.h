// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <charconv>
#include <string>

namespace lensforge {

/// A number with a fixed count of decimals: no exponent, no negative zero, a point in any locale.
inline std::string decimal_text(double value, int decimals) {
  char digits[400];  // The largest double has 309 digits before the point.
  const auto [end, error] =
      std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals);
  std::string text(digits, error == std::errc() ? end : digits);
  const bool zero = text.find_first_of("123456789") == std::string::npos;
  if (zero && text.starts_with('-') && text.find('0') != std::string::npos) text.erase(0, 1);
  return text;
}

}  // namespace lensforge
