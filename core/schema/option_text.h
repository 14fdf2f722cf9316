// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "core/schema/description.h"

/// Options as text: what help, manual page and Python's docstrings say of them, and their values as
/// typed.
namespace lensforge {

/// Converts a typed value to its option's type. @throw InputError naming option, value and rule.
FieldValue value_of(const FieldSpec& option, const std::string& text);

/// A value as the help shows it.
std::string value_text(const FieldValue& value);

/// A value's placeholder: "N", "MM", "a|b".
std::string placeholder(const FieldSpec& option);

/// The help with unit and limits.
std::string help_text(const FieldSpec& option);

/// An option with its default as an item of a manual page, in mdoc.
std::string manual_item(const Field& option);

/// Python's keyword for an option: "image_width" for "--image-width".
std::string keyword_of(const std::string& option);

/// Python's type of an option: "float, mm, or a text with its unit".
std::string python_type(const FieldSpec& option);

/// An option as a line of a docstring: keyword, type, help, limits or words, and default.
/// @param initial  the default in words; empty if there is none.
std::string docstring_line(const FieldSpec& option, const std::string& initial = "");

/// The message with Python's keywords for options: "image_width" for "--image-width".
std::string in_keywords(const std::string& message);

}  // namespace lensforge
