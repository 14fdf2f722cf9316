// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/page/script_data.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/page/html_text.h"

namespace lensforge {

std::string script_json(const nlohmann::json& value) {
  std::string text;
  for (const char c : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)) {
    if (c == '<') {
      text.append("\\u003c");
    } else {
      text.push_back(c);
    }
  }
  return text;
}

std::string data_element(std::string_view id, std::string_view type, std::string_view text) {
  return element("script", joined({"type=\"", type, "\" id=\"", id, "\""}), text) + "\n";
}

double PackedNumbers::add(double value, double low, double high) {
  const double most = std::ldexp(1.0, 8 * bytes_) - 1.0;
  const double share = high > low ? (value - low) / (high - low) : 0.0;
  const auto number = static_cast<std::uint32_t>(std::lround(most * std::clamp(share, 0.0, 1.0)));
  for (int k = 0; k < bytes_; ++k) {
    packed_.push_back(static_cast<unsigned char>(number >> (8U * static_cast<unsigned>(k))));
  }
  return low + (high - low) * number / most;
}

std::string PackedNumbers::text() const { return base64(packed_); }

}  // namespace lensforge
