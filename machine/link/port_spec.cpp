// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/port_spec.h"

#include <charconv>
#include <optional>

#include "core/error.h"

namespace lensforge {
namespace {

constexpr int kSlowestBaud = 1200;
constexpr int kFastestBaud = 12'000'000;
constexpr int kLastTcpPort = 65535;

[[noreturn]] void refuse(std::string_view text, const std::string& rule) {
  throw InputError("--port '" + std::string(text) + "': " + rule);
}

std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stopped != end) return std::nullopt;
  return number;
}

PortSpec tcp_spec(std::string_view whole, std::string_view rest) {
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos || colon == 0) refuse(whole, "must read tcp:HOST:PORT");
  const auto number = whole_number(rest.substr(colon + 1));
  if (!number || *number < 1 || *number > kLastTcpPort) {
    refuse(whole, "the TCP port must be an integer, 1 to 65535");
  }
  std::string_view host = rest.substr(0, colon);
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  if (!bracketed && host.find(':') != std::string_view::npos) {
    refuse(whole, "an IPv6 address needs brackets, tcp:[::1]:PORT");
  }
  return {PortSpec::Kind::kTcp, std::string(host), 0, static_cast<std::uint16_t>(*number)};
}

/// Device names hold colons too (/dev/serial/by-path/…-usb-0:1.2:1.0-port0): what stands after the
/// last one is a speed only if it is all digits, at least four of them.
PortSpec serial_spec(std::string_view text) {
  PortSpec spec{PortSpec::Kind::kSerial, std::string(text)};
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || text.size() - colon < 5) return spec;
  const auto baud = whole_number(text.substr(colon + 1));
  if (!baud) return spec;
  if (*baud < kSlowestBaud || *baud > kFastestBaud) {
    refuse(text, "the speed must be 1200 to 12000000 baud");
  }
  spec.place = std::string(text.substr(0, colon));
  spec.baud = *baud;
  return spec;
}

}  // namespace

PortSpec parse_port_spec(std::string_view text) {
  if (text.starts_with("sim:")) {
    return {PortSpec::Kind::kSimulated, std::string(text.substr(4))};
  }
  if (text.starts_with("tcp:")) return tcp_spec(text, text.substr(4));
  if (text.starts_with('/')) return serial_spec(text);
  refuse(text, "must be a device such as /dev/ttyUSB0[:115200], tcp:HOST:PORT or sim:");
}

std::string port_name(const PortSpec& spec) {
  switch (spec.kind) {
    case PortSpec::Kind::kSerial:
      return spec.place + ":" + std::to_string(spec.baud);
    case PortSpec::Kind::kTcp: {
      const bool v6 = spec.place.find(':') != std::string::npos;
      const std::string host = v6 ? "[" + spec.place + "]" : spec.place;
      return "tcp:" + host + ":" + std::to_string(spec.tcp_port);
    }
    case PortSpec::Kind::kSimulated:
      break;
  }
  return "sim:" + spec.place;
}

}  // namespace lensforge
