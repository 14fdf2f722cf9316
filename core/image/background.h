// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>

namespace lensforge {

class Description;

/// sRGB colour behind the transparent parts of a picture.
struct Background {
  std::array<int, 3> rgb{};  ///< 0 … 255 each; black.

  /// "black", "white" or "#RRGGBB". @throw InputError naming option, value and rule.
  static Background parse(const std::string& text);
  [[nodiscard]] std::string text() const;
  /// Linear luminance; 1 is white.
  [[nodiscard]] double light() const;

  friend bool operator==(const Background&, const Background&) = default;
};

/// The option for all commands that read pictures.
void describe(Description& d, Background& background);

}  // namespace lensforge
