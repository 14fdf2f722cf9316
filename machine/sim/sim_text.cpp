// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_text.h"

#include <array>
#include <charconv>
#include <cmath>

namespace lensforge {

std::string fixed_text(double value, int decimals) {
  std::array<char, 64> digits{};
  // No negative zero, at whatever decimals.
  if (std::abs(value) < 0.5 * std::pow(10.0, -decimals)) value = 0.0;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                          std::chars_format::fixed, decimals);
  return error == std::errc() ? std::string(digits.data(), end) : "0";
}

std::string numbered(const std::string& word, std::int64_t number) {
  return word + std::to_string(number);
}

std::string fixed_text(const Eigen::Vector3d& value, int decimals) {
  return fixed_text(value.x(), decimals) + "," + fixed_text(value.y(), decimals) + "," +
         fixed_text(value.z(), decimals);
}

}  // namespace lensforge
