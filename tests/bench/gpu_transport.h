// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench/gpu_rates.h"

namespace lensforge::bench {

/// Transport on a GPU: every kernel of a Newton step at the paper's size, a step's parts on both
/// processors, and whole transports.
void print_transport(const GpuRates& rates);

}  // namespace lensforge::bench
