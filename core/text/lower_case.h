// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// The text with A to Z as a to z; all other bytes stay, in any locale.
std::string lower_case(std::string text);

}  // namespace lensforge
