// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge::bench {

/// What a GPU does at most, measured: what kernels are held against.
struct GpuRates {
  double copy = 0.0;        ///< Bytes read and written per second by a long copy.
  double operations = 0.0;  ///< Additions and multiplications of doubles per second, not fused.
};

GpuRates measure_gpu_rates();

}  // namespace lensforge::bench
