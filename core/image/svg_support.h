// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string_view>

namespace lensforge {

/// An SVG feature that librsvg (2.54) does not draw.
struct UndrawnThing {
  std::string_view name;  ///< Name of the element, attribute or property.
  std::string_view what;  ///< Description in plain words.
  std::string_view advice;
  std::string_view harmless = "";  ///< Values without effect, separated by " | ".
};

/// Elements of SVG and of programs that write it. Elements in neither this table nor
/// drawn_elements() are not drawn either.
std::span<const UndrawnThing> undrawn_elements();

/// SVG elements that librsvg draws or uses, or that show nothing.
std::span<const std::string_view> drawn_elements();

/// Attributes of text only.
std::span<const UndrawnThing> undrawn_text_attributes();

/// Properties, as attributes and in styles, that change text; those that change other things; and
/// those that have a meaning only in styles.
std::span<const UndrawnThing> undrawn_text_properties();
std::span<const UndrawnThing> undrawn_properties();
std::span<const UndrawnThing> undrawn_style_properties();

/// The row with this name, or nullptr.
const UndrawnThing* find_undrawn(std::span<const UndrawnThing> table, std::string_view name);

/// True if this value, trimmed, has no effect.
bool is_harmless(const UndrawnThing& thing, std::string_view value);

}  // namespace lensforge
