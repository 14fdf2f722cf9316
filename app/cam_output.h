// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "cam/report/verdict.h"

namespace lensforge::app {

/// A line for every limit that a cut misses, and for what is advice.
std::string verdict_text(const Verdict& verdict);

}  // namespace lensforge::app
