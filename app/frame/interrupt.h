// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <functional>
#include <stop_token>
#include <thread>

namespace lensforge::app {

/// Until a watch is there, Ctrl-C (SIGINT), SIGTERM and SIGHUP end the process at once with exit
/// code 130; signals that the caller had ignored stay ignored. For the beginning of main(): while
/// the libraries of the program are being loaded, the system ends it by that signal.
void exit_at_signals() noexcept;

/// Whether a process that ends so prints an object on stdout, as --json asks for.
void print_json_at_signals(bool json) noexcept;

/// For the end of main(): the command is done and says so by its exit code.
void ignore_signals() noexcept;

/// What the second interrupt does.
enum class SecondInterrupt {
  kExit,     ///< Ends the process at once with exit code 130.
  kRequest,  ///< Is a request of its own (InterruptWatch::second_token()); the third ends it.
};

/// Turns the first Ctrl-C (SIGINT), SIGTERM or SIGHUP into a stop request; the second ends the
/// process at once with exit code 130, or is a request of its own. Signals that the caller had
/// ignored stay ignored. At most one at a time; a signal that came while an earlier one lived is a
/// request to this one, too.
class InterruptWatch {
 public:
  /// @param overdue  called by the watch's own thread if this object still lives some 0.7 s after
  ///                 the first request; not where it is empty.
  explicit InterruptWatch(SecondInterrupt second = SecondInterrupt::kExit,
                          std::function<void()> overdue = {});
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  /// Acts as a signal does.
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
