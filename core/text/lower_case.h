// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// The text with A to Z as a to z and all other bytes unchanged, in any locale.
std::string lower_case(std::string text);

}  // namespace lensforge
