// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/optics/optical_setup.h"
#include "core/schema/json.h"

namespace lensforge {

/// The optical setup in lens.json: docs/interface.md lists its keys. `focal_length` is omitted if
/// the screen is turned, so that programs which know only unturned screens do not misread the file.
nlohmann::ordered_json setup_json(const OpticalSetup& setup);

/// Reads it back; without "screen" the screen is not turned. Values are for validate() to check.
/// @param folder  that holds a front's heights.
/// @throw InputError naming the field if something is missing or of another type, or the file.
OpticalSetup read_setup(const JsonFields& fields, const std::filesystem::path& folder = {});

/// The file in the lens folder that a field names. @throw InputError if it is elsewhere.
std::filesystem::path named_file(const JsonFields& fields, const std::string& field,
                                 const std::filesystem::path& folder);

/// @throw InputError if "screen" contradicts the older keys.
void require_agreement(const JsonFields& fields, const OpticalSetup& setup);

}  // namespace lensforge
