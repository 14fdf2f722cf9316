// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lensforge {

/// Where a controller is to be found.
struct PortSpec {
  enum class Kind { kSerial, kTcp, kSimulated };
  Kind kind = Kind::kSimulated;
  std::string place;           ///< Device file, host name or address, or the simulator's options.
  int baud = 115200;           ///< Serial ports only.
  std::uint16_t tcp_port = 0;  ///< TCP only.
};

/// Reads "/dev/ttyUSB0", "/dev/ttyUSB0:250000", "tcp:host:port", "tcp:[::1]:port" or "sim:options".
/// @throw InputError naming --port, the value and the rule it broke.
PortSpec parse_port_spec(std::string_view text);

/// What parse_port_spec() takes, for messages.
std::string port_name(const PortSpec& spec);

}  // namespace lensforge
