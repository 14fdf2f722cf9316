// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

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

  /// A sentence for the reader, on stderr; nothing with --quiet.
  void note(const std::string& message) const;

  /// The result: `object` with --json, else `text`.
  void result(const nlohmann::json& object, const std::string& text) const;

 private:
  bool json_;
  bool quiet_;
};

}  // namespace lensforge::app
