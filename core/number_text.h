// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <charconv>
#include <string>

namespace lensforge {

/// The shortest text that reads back as the same number: "0.1", "23000", "1e-07"; a point in any
/// locale.
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

}  // namespace lensforge
