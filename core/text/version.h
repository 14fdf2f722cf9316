// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace lensforge {

/// "x.y.z"
std::string_view version();

/// "lensforge x.y.z", the mark in every file that the program writes.
std::string program_mark();

}  // namespace lensforge
