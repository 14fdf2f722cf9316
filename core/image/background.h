// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>

#include "core/text/option_field.h"

namespace lensforge {

/// What shows through the transparent parts of a picture: an sRGB colour.
struct Background {
  std::array<int, 3> rgb{};  ///< 0 … 255 each; black.

  /// "black", "white" or "#RRGGBB". @throw InputError naming option, value and rule.
  static Background parse(const std::string& text);
  [[nodiscard]] std::string text() const;
  /// Its luminance, linear; 1 is white.
  [[nodiscard]] double light() const;

  friend bool operator==(const Background&, const Background&) = default;
};

/// The option of every command that reads pictures.
const OptionTable<Background>& background_fields();

}  // namespace lensforge
