// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>

#include "cam/coupon/coupon_fit.h"
#include "cam/tool/workshop.h"

namespace lensforge {

/// From readings to a workshop file.
struct WorkshopFit {
  std::filesystem::path readings;  ///< A filled-in template.
  Workshop workshop;               ///< That cut the coupon.
  std::filesystem::path out;       ///< Workshop file to write.
  bool force = false;              ///< Replace one that lensforge did not write.
  /// Is called when the work is done and the file is to be written.
  std::function<void()> before_writing = [] {};
};

/// Fits the readings and writes the workshop with the values that they determine. Everything else
/// of it stays; comments are the writer's own (workshop_toml()), and the first say what was fitted.
/// @throw InputError as parse_readings() and fit_coupon(), if the readings determine none of the
///        values, if the workshop breaks a rule with them, or if `out` must not be replaced.
/// @throw RunError if it cannot be written.
CouponFit fit_workshop(const WorkshopFit& task);

}  // namespace lensforge
