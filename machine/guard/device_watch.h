// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "machine/guard/bus_session.h"

namespace lensforge {

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
