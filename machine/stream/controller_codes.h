// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// "error:22: no feed has been set"; for numbers that neither Grbl 1.1 nor grblHAL documents, that.
std::string explain_error(int code);

/// "ALARM:1: a limit switch …", likewise.
std::string explain_alarm(int code);

}  // namespace lensforge
