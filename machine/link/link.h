// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

namespace lensforge {

/// The link is gone: unplugged, closed by the other side, or an error of the operating system.
class LinkLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A two-way stream of bytes to a controller: a serial port, a TCP connection or a simulation.
class Link {
 public:
  virtual ~Link() = default;
  /// Returns the bytes that have arrived; waits at most `wait` seconds of the link's clock for the
  /// first one. Empty if none arrived. @throw LinkLost
  virtual std::string read(double wait) = 0;
  /// Writes as many bytes as the link accepts at once, at least one unless its buffer is full.
  /// @return their number. @throw LinkLost
  virtual std::size_t write(std::string_view bytes) = 0;
};

/// A sender's time: the computer's steady clock, or a simulated controller's virtual time, in which
/// hours of cutting take seconds.
class Clock {
 public:
  virtual ~Clock() = default;
  /// Seconds since an arbitrary fixed moment; never runs backwards.
  [[nodiscard]] virtual double now() const = 0;
  /// Lets `seconds` pass.
  virtual void wait(double seconds) = 0;
};

/// The computer's steady clock.
class SteadyClock : public Clock {
 public:
  [[nodiscard]] double now() const override {
    const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double>(since_start).count();
  }
  void wait(double seconds) override {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  }
};

}  // namespace lensforge
