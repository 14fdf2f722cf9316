// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "cam/coupon/coupon_fit.h"
#include "cam/coupon/coupon_layout.h"
#include "cam/coupon/coupon_readings.h"

namespace lensforge {

/// Content of the measuring sheet of a coupon.
struct CouponSheet {
  CouponLayout layout;
  CouponReadings expected;
  CouponFit known;    ///< Uncertainty of each value if all readings are taken.
  std::string tool;   ///< In words.
  std::string files;  ///< Names of the programs.
  double minutes = 0.0;
  double thickness = 0.0;  ///< Of the blank, mm.
  std::vector<std::string> warnings;
};

/// One printable page: drawing, steps, quantities to measure, tools, and the keys for the readings.
std::string coupon_sheet(const CouponSheet& sheet);

/// The drawing alone, SVG: the coupon from above with its dimensions, marks, grooves and pads.
std::string coupon_drawing(const CouponLayout& layout);

}  // namespace lensforge
