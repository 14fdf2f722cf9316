// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>

#include "core/compute/executor.h"

namespace lensforge::bench {

/// Measured maximum rates of a GPU, for comparison with kernels.
struct GpuRates {
  double copy = 0.0;        ///< Bytes read and written per second by a long copy.
  double operations = 0.0;  ///< Additions and multiplications of doubles per second, not fused.
};

GpuRates measure_gpu_rates();

/// A line per kernel: calls, time, the bytes that it moves at least, their share of the copy rate.
void print_kernel_rows(const KernelProfile& profile,
                       const std::map<std::string, double>& least_bytes, const GpuRates& rates);

}  // namespace lensforge::bench
