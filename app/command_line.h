// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge::app {

/// Whether errors are to be told as JSON too: also where the command line is what is wrong.
bool wants_json(const std::vector<std::string>& arguments);

/// Runs the subcommand that `arguments` (without the program's name) asks for and returns the exit
/// code of docs/interface.md. Every error ends up as one line on stderr; nothing is thrown.
int run_command_line(const std::vector<std::string>& arguments) noexcept;

/// All that main() does: holds the standard descriptors, ignores the signals that writing raises,
/// and runs the command line.
int run_main(int argc, char** argv) noexcept;

}  // namespace lensforge::app
