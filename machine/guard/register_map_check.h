// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "machine/guard/register_map.h"

namespace lensforge {

/// Checks what the keys of a register map say together, beyond what each may hold: that the
/// commands differ in what they leave in the drive, that the speed has a register of its own and is
/// told and read as finely as it is judged, that nothing is read back from where it was written,
/// and that standing still is no speed.
/// @param file  what to call it in errors. @throw InputError naming file, keys and rule.
void check_register_map(const RegisterMap& map, const std::string& file);

}  // namespace lensforge
