// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "core/optics/optical_setup.h"
#include "core/text/json_fields.h"

namespace lensforge {

/// The part of lens.json that says what lights the surface and where the picture is:
/// docs/interface.md lists its keys. `focal_length` is left out where the screen is turned, so that
/// no program that knows of unturned ones only misreads the file.
nlohmann::ordered_json setup_json(const OpticalSetup& setup);

/// Reads it back; without "screen" the screen is not turned. Values are for validate() to check.
/// @param folder  in which a front's heights lie.
/// @throw InputError naming the field if something is missing or of another type, or a file.
OpticalSetup read_setup(const JsonFields& fields, const std::filesystem::path& folder = {});

/// The file in the lens folder that a field names. @throw InputError if it lies elsewhere.
std::filesystem::path named_file(const JsonFields& fields, const std::string& field,
                                 const std::filesystem::path& folder);

/// @throw InputError if "screen" is not where the older keys say.
void require_agreement(const JsonFields& fields, const OpticalSetup& setup);

}  // namespace lensforge
