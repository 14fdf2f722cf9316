// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge::app {

/// Writes `text` to stdout as it is and flushes it.
/// @throw RunError if stdout does not take it (closed pipe, full disk).
void print_to_stdout(std::string_view text);

/// Prints "lensforge: message" as one line on stderr and, with `json`, {"error", "exit_code"} on
/// stdout. Returns `exit_code`; never throws.
int report_error(const std::string& message, int exit_code, bool json) noexcept;

/// Characters in a line of the terminal on stderr; 80 where that cannot be told.
std::size_t terminal_width();

/// Where a command's words go: messages to stderr, the result to stdout.
class Console {
 public:
  Console(bool json, bool quiet) : json_(json), quiet_(quiet) {}

  /// A sentence for the reader, on stderr; nothing with --quiet. It is held back until begin(), so
  /// that a refusal, after which nothing else matters, is the only line.
  void note(const std::string& message) const;

  /// Says that nothing is refused any more: notes so far are printed, later ones at once.
  void begin() const;

  /// The result: `object` with --json, else `text`. Notes so far are printed before it.
  void result(const nlohmann::json& object, const std::string& text) const;

 private:
  bool json_;
  bool quiet_;
  mutable bool begun_ = false;
  mutable std::vector<std::string> held_;
};

}  // namespace lensforge::app
