// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/host_device.h"

namespace lensforge {

/// min(max(x, low), high), low for a NaN. std::fmin() and std::fmax() compile to calls because of
/// their NaN rules; this compiles to two instructions.
LF_HD LF_INLINE double clamped(double x, double low, double high) {
  const double raised = x > low ? x : low;
  return raised < high ? raised : high;
}

}  // namespace lensforge
