// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "machine/guard/register_map.h"

namespace lensforge {

/// Reads a register map (TOML, see machine/guard/maps/generic_plc.toml for every key).
/// @param file  what to call it in errors.
/// @throw InputError naming file, key, value and rule: not TOML, a key that is unknown, missing or
/// of the wrong type, a value out of range, or a protocol that is not Modbus.
RegisterMap parse_register_map(std::string_view text, const std::string& file);

/// parse_register_map() of a file of at most 1 MiB.
RegisterMap read_register_map(const std::filesystem::path& path);

/// Puts another serial port ("/dev/ttyUSB1") or another host ("10.0.0.7" or "10.0.0.7:1502") in
/// place of the map's. @throw InputError if `endpoint` is not what the map's transport needs.
void set_endpoint(RegisterMap& map, const std::string& endpoint);

}  // namespace lensforge
