// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lensforge {

/// Maximum parts of a dotted key, and maximum depth of brackets, in a TOML document.
inline constexpr int kMaxTomlDepth = 32;

/// Returns why a TOML document is nested too deeply to parse: "line N: …"; nothing if it is not.
/// The document need not be well-formed.
std::optional<std::string> toml_nesting_problem(std::string_view text);

}  // namespace lensforge
