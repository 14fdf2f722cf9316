// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/register_map.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace lensforge {
namespace {

const char* kind_of(int function) {
  switch (function) {
    case 1:
    case 5:
    case 15:
      return "coil";
    case 2:
      return "discrete input";
    case 4:
      return "input register";
    default:
      return "holding register";
  }
}

double rpm_per_unit(const SpeedScale& scale, double rpm_per_hz) {
  return scale.in_hertz ? rpm_per_hz : 1.0;
}

}  // namespace

double rpm_of_raw(const SpeedScale& scale, double rpm_per_hz, std::uint16_t raw) {
  const double number = scale.is_signed ? static_cast<double>(static_cast<std::int16_t>(raw))
                                        : static_cast<double>(raw);
  return std::abs((number * scale.scale + scale.offset) * rpm_per_unit(scale, rpm_per_hz));
}

std::optional<std::uint16_t> raw_of_rpm(const SpeedScale& scale, double rpm_per_hz, double rpm) {
  const double value = rpm / rpm_per_unit(scale, rpm_per_hz);
  const double raw = std::round((value - scale.offset) / scale.scale);
  const double most = scale.is_signed ? 32767.0 : 65535.0;
  if (!(raw >= 0.0) || !(raw <= most)) return std::nullopt;
  return static_cast<std::uint16_t>(raw);
}

std::string address_text(const RegisterAddress& at) {
  std::array<char, 16> hex{};
  std::snprintf(hex.data(), hex.size(), " 0x%04X", static_cast<unsigned>(at.address));
  return kind_of(at.function) + std::string(hex.data());
}

}  // namespace lensforge
