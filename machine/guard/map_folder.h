// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lensforge {

/// The register maps that come with the program ("yl620", "h100" ...), in alphabetical order; from
/// share/lensforge/spindle beside the running program, or from the source tree of its build.
std::vector<std::string> shipped_register_maps();

/// @param name  a shipped map, or a path to a file (with a slash, or ending in .toml).
/// @return the file. @throw InputError if there is no such map, or the name is one of the old
/// Huanyang drives', which do not speak Modbus.
std::filesystem::path find_register_map(const std::string& name);

/// Why a Huanyang HY drive cannot be used.
std::string huanyang_refusal();

}  // namespace lensforge
