// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace lensforge {

/// Maximum nesting depth of a JSON document.
inline constexpr int kMaxJsonDepth = 64;

/// Parses a JSON document strictly.
/// @param name  the file's name in messages.
/// @throw InputError "name: is no JSON: …" naming the byte, or that a number is beyond the range of
///        doubles, that a name is repeated in an object or that it is nested too deeply; in short
///        words of our own, never the library's.
nlohmann::json parse_json(std::string_view text, const std::string& name);

}  // namespace lensforge
