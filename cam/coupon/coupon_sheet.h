// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "cam/coupon/coupon_fit.h"
#include "cam/coupon/coupon_layout.h"
#include "cam/coupon/coupon_readings.h"

namespace lensforge {

/// What stands on the sheet that goes with a coupon to the bench.
struct CouponSheet {
  CouponLayout layout;
  CouponReadings expected;
  CouponFit known;    ///< How well the readings will tell each value, if all are taken.
  std::string tool;   ///< In words.
  std::string files;  ///< Names of the programs.
  double minutes = 0.0;
  double thickness = 0.0;  ///< Of the blank, mm.
  std::vector<std::string> warnings;
};

/// One printable page: drawing, steps, what to measure with what, and under which key it goes.
std::string coupon_sheet(const CouponSheet& sheet);

/// The drawing alone, SVG: the coupon from above with its dimensions, marks, grooves and pads.
std::string coupon_drawing(const CouponLayout& layout);

}  // namespace lensforge
