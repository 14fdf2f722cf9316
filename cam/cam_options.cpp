// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "cam/cam_job.h"
#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kMaxFeed = 1e5;        ///< mm/min; beyond what any mill can follow.
constexpr double kMaxSpindleRpm = 1e6;  ///< Ten times the fastest spindles.
constexpr double kMaxLength = 1000.0;   ///< mm; of heights above the part.
constexpr double kMaxSpinUp = 3600.0;   ///< s

std::string number(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return error == std::errc() ? std::string(text, end) : std::string("?");
}

[[noreturn]] void refuse(const char* option, double value, const std::string& rule) {
  throw InputError(std::string(option) + ": " + number(value) + " " + rule);
}

/// NaN fails every comparison and so is refused as well.
void require_in(const char* option, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    refuse(option, value, "is not between " + number(low) + " and " + number(high));
  }
}

void require_above_zero(const char* option, double value, double high) {
  if (!(value > 0.0 && value <= high)) {
    refuse(option, value, "is not above 0 and at most " + number(high));
  }
}

}  // namespace

ZZero parse_z_zero(std::string_view name) {
  if (name == "stock") return ZZero::kStock;
  if (name == "table") return ZZero::kTable;
  if (name == "lens") return ZZero::kLens;
  throw InputError("--z-zero: '" + std::string(name) + "' is none of stock, table, lens");
}

void validate(const CamOptions& options, const OpticalSetup& setup) {
  require_above_zero("--tool-diameter", options.tool_diameter, kMaxLength);
  const double smallest = setup.lens_size.minCoeff();
  if (!(options.tool_diameter < smallest)) {
    refuse("--tool-diameter", options.tool_diameter,
           "is not smaller than the lens, whose shorter side is " + number(smallest) + " mm");
  }
  require_above_zero("--pitch", options.pitch, kMaxLength);
  if (options.pitch > options.tool_diameter) {
    refuse("--pitch", options.pitch,
           "is larger than the tool diameter, " + number(options.tool_diameter) + " mm");
  }
  require_above_zero("--spindle", options.spindle_rpm, kMaxSpindleRpm);
  require_above_zero("--feed", options.feed, kMaxFeed);
  require_above_zero("--plunge", options.plunge, kMaxFeed);
  require_in("--stock", options.stock, 0.0, kMaxLength);
  require_above_zero("--safe-height", options.safe_height, kMaxLength);
  require_in("--spin-up", options.spin_up, 0.0, kMaxSpinUp);
  require_in("--decimals", options.decimals, 4, 6);
  const double finest = 4.0 * std::pow(10.0, -options.decimals);
  if (!(options.tolerance >= finest * (1.0 - 1e-12) && options.tolerance <= kMaxLength)) {
    refuse("--tolerance", options.tolerance,
           "is not at least 4 units of the last decimal, " + number(finest) + " mm");
  }
  require_above_zero("--slope-tolerance", options.slope_tolerance, 1.0);
}

}  // namespace lensforge
