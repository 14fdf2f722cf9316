// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench/markdown_table.h"
#include "core/compute/executor.h"

namespace lensforge::bench {

/// Yearly sunlight that drawn façades reflect to places before them, in London and Las Vegas,
/// before and after --goal deflect.
MarkdownTable glare_table(const Executor& executor);

}  // namespace lensforge::bench
