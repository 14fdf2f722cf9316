// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "machine/guard/register_map.h"
#include "machine/link/link.h"

namespace lensforge {

/// Keeps one device's bus connected: opens it when it is needed, closes it when it broke, pauses
/// longer and longer before the next try, and leaves an RTU line alone until a late answer has
/// gone by. Retries nothing by itself.
class BusSession {
 public:
  BusSession(std::unique_ptr<RegisterBus> bus, const BusTransport& transport, Clock& clock);

  /// Whether an exchange may start now; false during a pause.
  [[nodiscard]] bool ready() const;
  /// @pre ready(). @throw BusError
  std::uint16_t read(const RegisterAddress& at);
  /// @pre ready(). @throw BusError
  void write(const RegisterAddress& at, std::uint16_t value);

 private:
  std::uint16_t exchange(const std::function<std::uint16_t()>& exchange);
  void recover(BusFault fault, double started);
  void hang_up(double from);

  std::unique_ptr<RegisterBus> bus_;
  BusTransport transport_;
  Clock& clock_;
  double not_before_;
  double pause_;
  int silences_ = 0;
  bool discard_first_ = true;
};

/// Polls the signals of one device, each at its interval, and tells which of them cannot be read
/// any more: more failures in a row than its retries, its own or the whole device's, or silence
/// beyond the device's limit.
class DeviceWatch {
 public:
  struct Reading {
    std::size_t signal;   ///< As counted by add().
    std::uint16_t value;  ///< Masked.
    double time;
  };

  DeviceWatch(BusSession session, double silence_limit, Clock& clock)
      : session_(std::move(session)), silence_limit_(silence_limit), clock_(clock) {}

  /// Takes a signal up. @return its number.
  std::size_t add(const ReadSignal& signal);
  /// Reads what is due, each signal at most once, and none more after one that was not answered:
  /// at most one time-out a call.
  std::vector<Reading> poll();
  /// Whether write() may be called now.
  [[nodiscard]] bool ready() const { return session_.ready(); }
  /// @pre ready(). @return what went wrong, or nothing.
  std::optional<std::string> write(const RegisterAddress& at, std::uint16_t value);
  /// Why the signal's last value is not to be relied on; or empty.
  [[nodiscard]] std::string trouble(std::size_t signal) const;

 private:
  struct Polled {
    ReadSignal signal;
    double due;
    int failures = 0;
    std::string error;
  };

  bool read_one(std::size_t index, std::vector<Reading>& readings);

  BusSession session_;
  double silence_limit_;
  Clock& clock_;
  std::vector<Polled> polled_;
  std::optional<double> silent_since_;  ///< The first request since which none was answered.
  std::string last_error_;
  int unanswered_ = 0;  ///< Requests in a row.
};

}  // namespace lensforge
