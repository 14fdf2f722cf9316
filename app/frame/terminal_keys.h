// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include "core/io/descriptor.h"
#include "machine/stream/sender.h"

namespace lensforge::app {

/// What the keys mean, in a line.
inline constexpr std::string_view kKeyHelp =
    "space or h holds, r resumes, + - = feed up, down and 100 %, 1 2 3 rapids at 100, 50 and 25 %, "
    "> < . spindle up, down and 100 %, Q (capital) ends the job like Ctrl-C";

/// Keys typed on the terminal that is standard input, without Enter and without echo; no keys where
/// standard input is no terminal, and none while the process is in the background. Ctrl-Z does
/// nothing meanwhile: a sender that sleeps watches no spindle. The terminal is as before after
/// destruction, while the process is stopped by a signal and after one that ends it. At most one at
/// a time.
class TerminalKeys {
 public:
  /// @param abort  called for each Q, from another thread.
  explicit TerminalKeys(std::function<void()> abort);
  ~TerminalKeys();
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  /// Whether there is a terminal to read from.
  [[nodiscard]] bool active() const { return reader_.joinable(); }
  /// The oldest order that was not handed over yet.
  std::optional<OperatorKey> next();

 private:
  void read_keys();
  void take(char key);

  std::function<void()> abort_;
  Descriptor wake_read_;
  Descriptor wake_write_;  ///< Closed to end the reader.
  std::mutex mutex_;
  std::deque<OperatorKey> orders_;
  std::thread reader_;
};

/// Gives the terminal back as TerminalKeys found it; does nothing without one. For ends of the
/// process that run no destructor; async-signal-safe.
void restore_terminal() noexcept;

}  // namespace lensforge::app
