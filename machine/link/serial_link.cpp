// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/serial_link.h"

#include <libserialport.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "core/error.h"
#include "machine/link/poll_wait.h"

namespace lensforge {
namespace {

constexpr int kDataBits = 8;
constexpr std::size_t kReadBytes = 4096;

std::string reason(int error) { return std::generic_category().message(error); }

/// The library's last error in words, which it hands out in memory of its own.
std::string last_error() {
  char* message = sp_last_error_message();
  std::string text = message != nullptr ? message : "unknown error";
  sp_free_error_message(message);
  return text;
}

void require(sp_return result, const PortSpec& spec, const std::string& what) {
  if (result == SP_OK) return;
  const std::string why = result == SP_ERR_FAIL ? last_error() : "not possible on this port";
  throw InputError("--port " + port_name(spec) + ": " + what + ": " + why);
}

/// Every byte as it is, both ways.
void make_raw(int descriptor) {
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) return;
  ::cfmakeraw(&settings);
  ::tcsetattr(descriptor, TCSANOW, &settings);
}

/// Without HUPCL the system keeps DTR raised when the port is closed, so the next opening makes no
/// edge and resets no board.
void keep_dtr_when_closed(int descriptor) {
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) return;
  settings.c_cflag &= ~static_cast<tcflag_t>(HUPCL);
  ::tcsetattr(descriptor, TCSANOW, &settings);
}

}  // namespace

void SerialLink::ClosePort::operator()(sp_port* port) const {
  sp_close(port);
  sp_free_port(port);
}

SerialLink::SerialLink(const PortSpec& spec) : name_(spec.place), lock_(spec) {
  if (::isatty(lock_.descriptor()) == 0) {
    throw InputError("--port " + port_name(spec) + ": no serial port");
  }
  // libserialport knows real ports only, and a pseudo-terminal has no speed to set.
  const std::string device = std::filesystem::canonical(spec.place).string();
  if (device.starts_with("/dev/pts/")) {
    make_raw(lock_.descriptor());
  } else {
    configure(spec, device);
  }
  keep_dtr_when_closed(lock_.descriptor());
}

void SerialLink::configure(const PortSpec& spec, const std::string& device) {
  sp_port* port = nullptr;
  require(sp_get_port_by_name(device.c_str(), &port), spec, "no serial port");
  port_.reset(port);
  require(sp_open(port, SP_MODE_READ_WRITE), spec, "cannot be opened");
  require(sp_set_baudrate(port, spec.baud), spec, "speed not taken");
  require(sp_set_bits(port, kDataBits), spec, "eight data bits not taken");
  require(sp_set_parity(port, SP_PARITY_NONE), spec, "no parity not taken");
  require(sp_set_stopbits(port, 1), spec, "one stop bit not taken");
  require(sp_set_flowcontrol(port, SP_FLOWCONTROL_NONE), spec, "no flow control not taken");
}

void SerialLink::lose(const std::string& why) const {
  throw LinkLost("serial port " + name_ + " is gone: " + why);
}

std::string SerialLink::read(double wait) {
  const short events = wait_for(lock_.descriptor(), POLLIN, wait);
  if (events == 0) return {};
  std::array<char, kReadBytes> bytes{};
  const ssize_t count = ::read(lock_.descriptor(), bytes.data(), bytes.size());
  if (count > 0) return {bytes.data(), static_cast<std::size_t>(count)};
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  // A port that is ready but has nothing to give was unplugged or hung up.
  lose(count == 0 ? "hung up" : reason(errno));
}

std::size_t SerialLink::write(std::string_view bytes) {
  const ssize_t count = ::write(lock_.descriptor(), bytes.data(), bytes.size());
  if (count >= 0) return static_cast<std::size_t>(count);
  if (errno == EAGAIN || errno == EINTR) return 0;
  lose(reason(errno));
}

}  // namespace lensforge
