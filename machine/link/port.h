// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "core/io/files.h"
#include "machine/link/link.h"

struct sp_port;

namespace lensforge {

/// Address of a controller.
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

/// The port in the form of parse_port_spec(), for messages.
std::string port_name(const PortSpec& spec);

/// Exclusive use of a port among senders, including root's, during this object's life: an advisory
/// lock (flock) on the device itself, or on a file that represents a TCP address. The system
/// releases it when the process ends, however it ends.
class PortLock {
 public:
  /// @throw InputError if another sender has the port or the device cannot be opened.
  explicit PortLock(const PortSpec& spec);

  /// The locked file, open for non-blocking reading and writing; −1 for the simulation.
  [[nodiscard]] int descriptor() const { return file_.number(); }

 private:
  Descriptor file_;
};

/// The file that is locked for `spec`: the device, or /run/lock/lensforge-… (the folder for
/// temporary files where there is no /run/lock).
std::filesystem::path lock_file(const PortSpec& spec);

/// Waits at most `seconds` until `descriptor` is ready for `events` (poll(2)); a signal does not
/// interrupt it. @return the events, 0 for none.
short wait_for(int descriptor, short events, double seconds);

/// A serial port, 8N1 without flow control, or a pseudo-terminal, for one sender.
///
/// Opening raises DTR, which resets 8-bit boards that connect it to reset. The port is then
/// configured so that closing and reopening it does not reset the board.
class SerialLink : public Link {
 public:
  /// @throw InputError if the device cannot be opened, is in use or does not take the speed.
  explicit SerialLink(const PortSpec& spec);

  std::string read(double wait) override;
  std::size_t write(std::string_view bytes) override;

 private:
  struct ClosePort {
    void operator()(sp_port* port) const;
  };

  void configure(const PortSpec& spec, const std::string& device);
  [[noreturn]] void lose(const std::string& why) const;

  std::string name_;
  PortLock lock_;
  std::unique_ptr<sp_port, ClosePort> port_;  ///< Null for a pseudo-terminal.
};

/// A TCP connection to a controller, for one sender on this computer. Bytes are sent at once (no
/// Nagle delay); a peer that falls silent is detected in about ten seconds.
class TcpLink : public Link {
 public:
  /// Connects, waiting at most `timeout` seconds for each address of the name. @throw InputError if
  /// the name has no address, another sender uses it, or there is no answer; Interrupted soon after
  /// `stop` requests it.
  explicit TcpLink(const PortSpec& spec, const std::stop_token& stop = {}, double timeout = 5.0);

  std::string read(double wait) override;
  std::size_t write(std::string_view bytes) override;

 private:
  [[noreturn]] void lose(const std::string& why) const;

  std::string name_;
  PortLock lock_;
  Descriptor socket_;
};

}  // namespace lensforge
