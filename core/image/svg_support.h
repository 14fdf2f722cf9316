// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string_view>

namespace lensforge {

/// Something that an SVG file may have and librsvg (2.54) does not draw.
struct UndrawnThing {
  std::string_view name;  ///< Of the element, attribute or property.
  std::string_view what;  ///< In plain words.
  std::string_view advice;
  std::string_view harmless = "";  ///< Values with which it changes nothing, set apart by " | ".
};

/// Elements of SVG and of programs that write it; any other that is not in drawn_elements() is left
/// out, too.
std::span<const UndrawnThing> undrawn_elements();

/// Elements of SVG that librsvg draws or looks at, or that show nothing.
std::span<const std::string_view> drawn_elements();

/// Attributes of text alone.
std::span<const UndrawnThing> undrawn_text_attributes();

/// Properties, as attributes and in styles, that change text; those that change all else; and those
/// that mean something in styles alone.
std::span<const UndrawnThing> undrawn_text_properties();
std::span<const UndrawnThing> undrawn_properties();
std::span<const UndrawnThing> undrawn_style_properties();

/// The row with this name; nullptr without one.
const UndrawnThing* find_undrawn(std::span<const UndrawnThing> table, std::string_view name);

/// Whether this value, without white space around it, changes nothing.
bool is_harmless(const UndrawnThing& thing, std::string_view value);

}  // namespace lensforge
