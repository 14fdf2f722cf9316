// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "core/compute/host_device.h"

namespace lensforge {

/// A function of one variable: value and slope.
struct ValueSlope {
  double value = 0.0;
  double slope = 0.0;
};

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace lensforge
