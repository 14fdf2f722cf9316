// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stop_token>

namespace lensforge::app {

/// Asks on the terminal whether to go on. @throw InputError if there is nobody to ask, or the
/// answer is not yes; Interrupted soon after `stop` asks for it.
void require_consent(const std::stop_token& stop);

}  // namespace lensforge::app
