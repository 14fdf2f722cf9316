// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

namespace lensforge::app {

/// Turns the first Ctrl-C (SIGINT), SIGTERM or SIGHUP into a stop request; the second ends the
/// process at once with exit code 130. Signals that the caller had ignored stay ignored. At most
/// one at a time.
class InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  [[nodiscard]] std::stop_token token() const { return stop_.get_token(); }

 private:
  void wait_for_signals();

  std::stop_source stop_;
  std::atomic<bool> finished_ = false;
  std::thread waiter_;
};

}  // namespace lensforge::app
