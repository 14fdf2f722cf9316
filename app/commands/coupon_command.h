// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/frame/option_set.h"
#include "cam/coupon/coupon_layout.h"

namespace lensforge::app {

/// Options of `lensforge coupon`.
struct CouponSettings {
  std::string out;            ///< Folder of the coupon, or the fitted workshop's file.
  std::string fit;            ///< Readings to fit; empty: make a coupon.
  std::string workshop;       ///< TOML file; empty for the defaults.
  std::string workshop_text;  ///< Content of that file.
  CouponOptions coupon;
};

/// Describes every option of the command.
void describe(Description& d, CouponSettings& settings);

/// Reads the workshop. @throw InputError naming file or option, value and rule, also if an option
/// of the cut is given with --fit.
void settle(const OptionSet& options, CouponSettings& settings);

}  // namespace lensforge::app
