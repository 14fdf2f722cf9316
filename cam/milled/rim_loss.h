// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>

#include "cam/workshop/workshop.h"

namespace lensforge {

/// What over-polish takes off at a distance from one side of the lens, mm:
/// rim_depth · exp(−distance / rim_length).
inline double rim_loss(const PolishModel& model, double distance) {
  return model.rim_depth * std::exp(-std::max(distance, 0.0) / model.rim_length);
}

}  // namespace lensforge
