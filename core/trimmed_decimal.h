// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "core/decimal_text.h"

namespace lensforge {

/// decimal_text() without zeros behind its point: "0.3", "12".
inline std::string trimmed_decimal(double value, int decimals) {
  std::string text = decimal_text(value, decimals);
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace lensforge
