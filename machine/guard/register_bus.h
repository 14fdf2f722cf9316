// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace lensforge {

/// What went wrong in an exchange with a device.
enum class BusFault {
  kDown,     ///< Not connected, or the connection broke.
  kSilent,   ///< No whole answer within the response time-out.
  kRefused,  ///< The device answered with an exception.
  kGarbled,  ///< An answer that does not belong to the request: checksum, length, unit, or echo.
};

/// An exchange failed; the message says how, without the device's name.
class BusError : public std::runtime_error {
 public:
  BusError(BusFault fault, const std::string& what) : std::runtime_error(what), fault_(fault) {}
  [[nodiscard]] BusFault fault() const { return fault_; }

 private:
  BusFault fault_;
};

/// One register or coil as a Modbus function reaches it.
struct RegisterAddress {
  int function = 3;  ///< 1 coil, 2 discrete input, 3 holding, 4 input register; 5, 6, 15, 16 write.
  int address = 0;   ///< As sent on the wire, counted from 0.
};

/// The words and bits of one device. One exchange a call, no retry, no recovery of its own; every
/// call is bounded by the device's time-outs.
class RegisterBus {
 public:
  virtual ~RegisterBus() = default;
  /// Connects. @throw BusError
  virtual void open() = 0;
  virtual void close() = 0;
  [[nodiscard]] virtual bool is_open() const = 0;
  /// Throws away whatever has come in.
  virtual void discard() = 0;
  /// @return the register's value, or 0 or 1 of a coil. @throw BusError
  virtual std::uint16_t read(const RegisterAddress& at) = 0;
  /// Writes and checks the device's echo. @throw BusError
  virtual void write(const RegisterAddress& at, std::uint16_t value) = 0;
};

}  // namespace lensforge
