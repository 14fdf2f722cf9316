// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <string_view>

#include "app/frame/command_line.h"

namespace lensforge::app {

/// Result of a command that ran in its own process.
struct ChildEnd {
  int exit_code = 0;  ///< 128 + the signal's number if a signal ended it.
  double seconds = 0.0;
};

/// A command in a process of its own.
struct ChildCommand {
  Arguments program;                  ///< Words that start a command; none: this very program.
  Arguments words;                    ///< The command and its arguments.
  std::filesystem::path out;          ///< Receives standard output; replaced.
  std::filesystem::path log;          ///< Standard error is added to it.
  std::filesystem::path folder = {};  ///< In which it works; empty: this process's.
  int input = -1;                     ///< Descriptor of its standard input; none: /dev/null.
};

/// Runs the command. When `stop` is requested, or the calling thread ends, it is interrupted as by
/// Ctrl-C. @throw RunError with the system's reason if no process can be made or a file not be
/// written.
ChildEnd run_child(const ChildCommand& child, const std::stop_token& stop);

/// The last line that a command wrote, without the program's name; empty if there is none.
std::string last_line(std::string_view text);

/// The JSON in a file, such as a command's result; null if there is none.
nlohmann::json json_in(const std::filesystem::path& file);

}  // namespace lensforge::app
