// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/option_set.h"
#include "cam/report/verdict.h"

namespace lensforge::app {

/// A line for every limit that a cut misses.
std::string missed_limits_text(const Verdict& verdict);

/// Whether a cut holds the limits that count for the exit code: those of safety, and those of
/// quality that an option states; the defaults of the latter are advice.
bool stated_limits_hold(const OptionSet& options, const Verdict& verdict);

}  // namespace lensforge::app
