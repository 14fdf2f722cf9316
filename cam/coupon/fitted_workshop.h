// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "cam/coupon/coupon_fit.h"
#include "cam/tool/workshop.h"

namespace lensforge {

/// A workshop's file with polish.sigma, the finishing ball's diameter and finish.pitch_error
/// changed, and every other byte, comments among them, as it was.
/// @param text  TOML that parse_workshop() takes.
/// @param to    the same workshop with other values of these three.
/// @return nothing where the file cannot be changed so: it states no tools and the ball changes, or
///         it is written in a way that this does not follow.
std::optional<std::string> edited_workshop(const std::string& text, const Workshop& to);

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
