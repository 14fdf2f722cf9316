// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <functional>
#include <stop_token>
#include <thread>

namespace lensforge::app {

/// Until an InterruptWatch exists, Ctrl-C (SIGINT), SIGTERM and SIGHUP end the process at once with
/// exit code 130; signals that the caller had ignored stay ignored. Call it at the beginning of
/// main(). While libraries are being loaded before that, the signal itself ends the process.
void exit_at_signals() noexcept;

/// Sets whether such an exit prints a JSON object on stdout (--json).
void print_json_at_signals(bool json) noexcept;

/// Call it at the end of main(): a signal no longer changes the exit code of a finished command.
void ignore_signals() noexcept;

/// Effect of the second interrupt.
enum class SecondInterrupt {
  kExit,     ///< Ends the process at once with exit code 130.
  kRequest,  ///< A second request (InterruptWatch::second_token()); the third interrupt ends the
             ///< process.
};

/// Turns the first Ctrl-C (SIGINT), SIGTERM or SIGHUP into a stop request; the second ends the
/// process at once with exit code 130, or is a second request. Signals that the caller had ignored
/// stay ignored. At most one watch at a time; a signal received by an earlier watch is a request to
/// this one, too.
class InterruptWatch {
 public:
  /// @param overdue  called by the watch's own thread if this object still exists about 0.7 s after
  ///        the first request; may be empty.
  explicit InterruptWatch(SecondInterrupt second = SecondInterrupt::kExit,
                          std::function<void()> overdue = {});
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  /// Has the effect of a signal.
  static void interrupt();

  [[nodiscard]] std::stop_token token() const { return stop_.get_token(); }
  [[nodiscard]] std::stop_token second_token() const { return second_stop_.get_token(); }

 private:
  void wait_for_signals();
  bool wait_for_one();

  SecondInterrupt second_;
  std::function<void()> overdue_;
  std::stop_source stop_;
  std::stop_source second_stop_;
  std::atomic<bool> finished_ = false;
  std::thread waiter_;
};

}  // namespace lensforge::app
