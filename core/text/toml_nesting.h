// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lensforge {

/// Parts of a dotted key, and brackets within brackets, that a TOML document may have.
inline constexpr int kMaxTomlDepth = 32;

/// Why a TOML document is nested too deeply to be parsed: "line N: …"; nothing if it is not. It
/// need not be well-formed.
std::optional<std::string> toml_nesting_problem(std::string_view text);

}  // namespace lensforge
