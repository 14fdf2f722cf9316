// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/post/post_description.h"
#include "cam/post/program_plan.h"
#include "cam/workshop/workshop.h"
#include "core/text/option_field.h"

namespace lensforge {

/// What shapes a coupon, the test piece that calibrates a workshop's polish, ball and pitch.
struct CouponOptions {
  Workshop workshop;
  PostDescription post = find_post("linuxcnc", "--post");
  double length = 40.0;    ///< Between the two marks, across the passes, mm.
  double depth = 0.1;      ///< Of the pads below the top of the blank, mm.
  double thickness = 5.0;  ///< Of the blank, mm.
  double spin_up = 3.0;    ///< Dwell after the spindle was switched on, s.
  Coolant coolant = Coolant::kOff;
  bool force = false;  ///< Replace files that lensforge did not write as they stand.
};

/// The options as the command has them.
const OptionTable<CouponOptions>& coupon_fields();

/// @throw InputError naming option or key, value and rule.
void validate(const CouponOptions& options);

}  // namespace lensforge
