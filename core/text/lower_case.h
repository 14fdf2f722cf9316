// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// The text with A to Z as a to z and all other bytes unchanged, in any locale.
std::string lower_case(std::string text);

/// A to Z for a to z, and the other way round; all other bytes unchanged.
constexpr char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }
constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace lensforge
