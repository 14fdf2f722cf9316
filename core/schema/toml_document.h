// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <toml++/toml.h>

#include <string>
#include <string_view>

/// TOML as toml++ has it, for code that needs more than core/schema/toml.h: places in the text, any
/// key.
namespace lensforge {

/// @throw InputError naming file and line if `text` is not TOML, exceeds 1 MiB, or has a key of
///        more than 32 parts or brackets nested more than 32 deep.
toml::table parse_toml(std::string_view text, const std::string& file);

}  // namespace lensforge
