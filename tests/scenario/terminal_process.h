// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "scenario/driver.h"

namespace lensforge::scenario {

/// `lensforge ARGUMENTS` on its own terminal, like a foreground job of a shell; killed by the
/// destructor.
class TerminalProcess {
 public:
  explicit TerminalProcess(const Arguments& arguments);
  ~TerminalProcess();
  TerminalProcess(const TerminalProcess&) = delete;
  TerminalProcess& operator=(const TerminalProcess&) = delete;

  void press(const std::string& keys) const;
  void send(int signal) const;
  /// All that was written to the terminal so far.
  [[nodiscard]] std::string screen();
  bool shows(const std::string& text);
  /// True if the terminal is in its normal mode: typed lines wait for Enter and are echoed.
  [[nodiscard]] bool line_by_line() const;
  /// True if a signal has stopped it.
  [[nodiscard]] bool stopped() const;
  /// Its exit code, 128 + the signal's number, or −1 if it does not end.
  int wait();

 private:
  void read_screen();

  int master_ = -1;
  pid_t shell_ = -1;
  pid_t job_ = -1;
  bool ended_ = false;
  std::mutex mutex_;
  std::string screen_;
  std::thread reader_;
};

/// Waits for up to ten seconds. @return whether it came true.
bool comes_true(const std::function<bool()>& fact);

}  // namespace lensforge::scenario
