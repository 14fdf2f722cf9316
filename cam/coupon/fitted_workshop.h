// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "cam/coupon/coupon_fit.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// From readings to a workshop file.
struct WorkshopFit {
  std::filesystem::path readings;  ///< A filled-in template.
  Workshop workshop;               ///< That cut the coupon.
  std::string workshop_text;       ///< The file that it was read from; empty for the defaults.
  std::filesystem::path out;       ///< Workshop file to write.
  bool force = false;              ///< Replace one that lensforge did not write.
  /// Is called when the work is done and the file is to be written.
  std::function<void()> before_writing = [] {};
};

/// Fits the readings and writes the workshop with the values that they determine. Everything else
/// of it stays, comments too (edited_workshop(); else those of workshop_toml()). The first comments
/// say what was fitted, in place of those of an earlier fit.
/// @throw InputError as parse_readings() and fit_coupon(), if the readings determine none of the
///        values, if the workshop breaks a rule with them, or if `out` must not be replaced.
/// @throw RunError if it cannot be written.
CouponFit fit_workshop(const WorkshopFit& task);

}  // namespace lensforge
