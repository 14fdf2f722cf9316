// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace lensforge {

/// Brackets within brackets that a JSON document may have.
inline constexpr int kMaxJsonDepth = 64;

/// Parses a JSON document strictly.
/// @param name  what to call the file in messages.
/// @throw InputError "name: is no JSON: …" naming the byte, or that a number is beyond the range of
///        doubles, that a name stands twice in an object or that it is nested too deeply; a few
///        words, never the library's.
nlohmann::json parse_json(std::string_view text, const std::string& name);

}  // namespace lensforge
