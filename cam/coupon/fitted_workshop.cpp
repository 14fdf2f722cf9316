// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/fitted_workshop.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "cam/coupon/workshop_edit.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/output_guard.h"
#include "core/text/number_text.h"
#include "core/text/printable.h"
#include "core/text/toml_fields.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

constexpr std::size_t kLongestName = 200;  ///< Of the readings' file, in a comment.

constexpr std::string_view kFitted = "# Fitted by ";
constexpr std::string_view kValue = "#   ";

std::array<const FittedValue*, 3> values_of(const CouponFit& fit) {
  return {&fit.sigma, &fit.diameter, &fit.pitch_error};
}

bool determines_any(const CouponFit& fit) {
  for (const FittedValue* value : values_of(fit)) {
    if (value->determined) return true;
  }
  return false;
}

/// Comments that say what was fitted to what.
std::string fitted_text(const CouponFit& fit, const std::string& readings) {
  std::string text =
      "# Fitted by " + program_mark() + " to " + printable_line(readings, kLongestName) + ":\n";
  for (const FittedValue* value : values_of(fit)) {
    text += std::string(kValue) + value->key +
            (value->determined
                 ? " = " + number_text(value->value) + " +- " + number_text(value->uncertainty, 2)
                 : " is not determined, left as it was") +
            "\n";
  }
  return text;
}

/// The file without the comments of an earlier fit at its beginning.
std::string without_fitted(std::string text) {
  if (!text.starts_with(kFitted)) return text;
  do {
    text.erase(0, std::min(text.find('\n'), text.size() - 1) + 1);
  } while (text.starts_with(kValue));
  return text;
}

}  // namespace

CouponFit fit_workshop(const WorkshopFit& task) {
  const std::string name = task.readings.string();
  const CouponReadings readings =
      parse_readings(read_toml_file(task.readings, "a file of readings"), name);
  CouponFit fit = fit_coupon(readings, task.workshop, name);
  if (!determines_any(fit)) {
    throw InputError(name + ": " + std::to_string(readings.count()) +
                     " readings: determine neither polish.sigma, tool.diameter nor "
                     "finish.pitch_error; take more of them, or more exact ones");
  }
  const Workshop fitted = fit.applied_to(task.workshop);
  validate(fitted, name + ", the workshop as fitted");
  require_replaceable("--out", task.out, task.force);
  task.before_writing();
  const auto edited = edited_workshop(without_fitted(task.workshop_text), fitted);
  write_whole_file(task.out, fitted_text(fit, name) + edited.value_or(workshop_toml(fitted)));
  return fit;
}

}  // namespace lensforge
