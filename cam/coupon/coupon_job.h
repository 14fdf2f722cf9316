// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cam/coupon/coupon_fit.h"
#include "cam/coupon/coupon_layout.h"
#include "cam/coupon/coupon_options.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

namespace lensforge {

/// Names of the files that make_coupon() writes beside its program.
namespace coupon_file {
inline constexpr const char* kSheet = "coupon.html";
inline constexpr const char* kReadings = "measured.toml";
}  // namespace coupon_file

/// What came out.
struct CouponResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::vector<std::filesystem::path> files;  ///< Programs first.
  CouponLayout layout;
  CouponFit known;  ///< With the uncertainties that the template states.
  double minutes = 0.0;
  /// What the machine must not do: collisions, unknown ways, motion beyond the travel.
  std::vector<std::string> faults;

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// Whether a file of this name may be one of a coupon.
bool is_name_of_coupon(const std::string& name);

/// Writes everything that calibrates a workshop: the coupon's program, the sheet with its drawing
/// and what to measure, and the file that the readings go into. All files get their names together
/// in the end. Same bytes for any number of threads.
/// @throw InputError as validate(), and naming files that would be replaced though lensforge did
/// not
///        write them as they stand, or though they hold readings, without CouponOptions::force.
/// @throw RunError if the files cannot be written.
CouponResult make_coupon(const CouponOptions& options, const std::filesystem::path& folder,
                         const Executor& executor, const RunControl& control);

}  // namespace lensforge
