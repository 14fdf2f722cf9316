// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cam/coupon/coupon_readings.h"
#include "cam/coupon/coupon_state.h"

namespace lensforge {

/// One reading with what a coupon's state makes of it.
struct ModelledReading {
  std::string key;    ///< "groove[2].width_mm (G3)"
  double unit = 1.0;  ///< Of the key: 1e-3 mm for a height in µm.
  Reading reading;    ///< mm, or a share.
  std::function<double(const CouponState&)> predicted;
  double least = 0.0;  ///< Of reading ÷ what is usual; beyond it is no such reading.
  double most = 0.0;
  bool polished = false;  ///< What is usual is as if it were not polished, which is the most.
};

/// Every reading that was taken.
std::vector<ModelledReading> modelled_readings(const CouponReadings& readings);

/// @throw InputError naming file, key, value and rule for a reading that a coupon of such a
/// workshop
///        cannot have.
void require_plausible(const std::vector<ModelledReading>& readings, const CouponState& expected,
                       const std::string& file);

}  // namespace lensforge
