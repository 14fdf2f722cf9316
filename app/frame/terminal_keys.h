// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include "core/io/files.h"
#include "machine/send.h"
#include "machine/stream/sender.h"

namespace lensforge::app {

/// One-line help for the keys.
inline constexpr std::string_view kKeyHelp =
    "space or h holds, r resumes, + - = feed up, down and 100 %, 1 2 3 rapids at 100, 50 and 25 %, "
    "> < . spindle up, down and 100 %, Q (capital) ends the job like Ctrl-C";

/// Source of keys.
enum class KeySource {
  kTerminal,  ///< Standard input, if it is a terminal.
  kAnyInput,  ///< Standard input, whatever it is; no keys after its end.
};

/// Reads keys from the terminal on standard input, without Enter and without echo. There are no
/// keys if standard input is no terminal or while the process is in the background. Ctrl-Z is
/// disabled: a suspended sender does not watch the spindle. The terminal's settings are restored by
/// the destructor, while a signal stops the process, and when a signal ends it. At most one object
/// at a time.
class TerminalKeys {
 public:
  /// @param abort  called for each Q, from another thread.
  explicit TerminalKeys(std::function<void()> abort, KeySource source = KeySource::kTerminal);
  ~TerminalKeys();
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  /// True if there is something to read from.
  [[nodiscard]] bool active() const { return reader_.joinable(); }
  /// Takes the oldest pending order.
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

/// Restores the terminal's settings if a TerminalKeys has changed them. For exits that run no
/// destructor; async-signal-safe.
void restore_terminal() noexcept;

}  // namespace lensforge::app
