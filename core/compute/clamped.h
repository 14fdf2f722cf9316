// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/host_device.h"

namespace lensforge {

/// min(max(x, low), high), low for a NaN. What the standard says of std::fmin() and std::fmax() and
/// NaN makes each a call; these are two instructions.
LF_HD LF_INLINE double clamped(double x, double low, double high) {
  const double raised = x > low ? x : low;
  return raised < high ? raised : high;
}

}  // namespace lensforge
