// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/option_field.h"

#include <algorithm>

#include "core/error.h"

namespace lensforge {

bool Limits::hold(double value) const {
  if (or_zero && value == 0.0) return true;
  return (low_excluded ? value > low : value >= low) && value <= high;
}

std::string Limits::rule() const {
  const std::string zero = or_zero ? "0, or " : "";
  return low_excluded ? zero + "above " + number_text(low) + ", at most " + number_text(high)
                      : zero + number_text(low) + " to " + number_text(high);
}

void OptionSpec::require(const std::string& text, double value) const {
  if (limits.hold(value)) return;
  throw InputError(name + " " + text + ": must be " + limits.rule() +
                   (unit.empty() ? "" : " " + unit));
}

void OptionSpec::require_word(const std::string& text) const {
  if (std::find(words.begin(), words.end(), text) != words.end()) return;
  std::string known;
  for (const std::string& word : words) known += (known.empty() ? "" : ", ") + word;
  throw InputError(name + " " + text + ": must be one of " + known);
}

}  // namespace lensforge
