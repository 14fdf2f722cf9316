// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/option_field.h"

#include <cmath>

#include "core/error.h"

namespace lensforge {

bool Limits::hold(double value) const {
  if (or_zero && value == 0.0) return true;
  return (low_excluded ? value > low : value >= low) && value <= high;
}

std::string Limits::rule() const {
  const std::string zero = or_zero ? "0, or " : "";
  const bool has_high = std::isfinite(high);
  if (low_excluded) {
    return zero + "above " + number_text(low) + (has_high ? ", at most " + number_text(high) : "");
  }
  if (has_high) return zero + number_text(low) + " to " + number_text(high);
  return zero + "at least " + number_text(low);
}

void OptionSpec::require(const std::string& text, double value) const {
  if (limits.hold(value)) return;
  throw InputError(name + " " + text + ": must be " + limits.rule() +
                   (unit.empty() ? "" : " " + unit));
}

}  // namespace lensforge
