// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lensforge {

/// Checks what holds for every IGES file in its fixed form (IGES 5.3, chapter 2) before OpenCASCADE
/// trusts it: lines of 80 columns, sections S G D P T in this order and numbered from 1, two lines
/// for each directory entry, pointers into the directory and the parameters that lead somewhere,
/// and a last line that counts the others right. Returns the number of entities.
/// @throw InputError "NAME: line 12: its parameters begin in line 40 of section P, which has 39"
///        and the like.
std::int64_t check_iges(std::string_view content, const std::string& name);

}  // namespace lensforge
