// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lensforge {

/// Checks what holds for every STEP file (ISO 10303-21) before OpenCASCADE trusts it: it begins as
/// one, has a whole DATA section, texts, comments and parentheses end, no entity is defined twice,
/// and each one that is named is defined. Returns the number of entities.
/// @throw InputError "NAME: line 12: #34 is used but nowhere defined" and the like.
std::int64_t check_part21(std::string_view content, const std::string& name);

}  // namespace lensforge
