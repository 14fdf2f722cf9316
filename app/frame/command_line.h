// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge::app {

/// What the command returns to the shell (docs/interface.md, "Exit codes").
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,         ///< It failed while running.
  kBadInput = 2,       ///< Bad usage or bad input.
  kLimitMissed = 3,    ///< Done, but a stated quality or safety limit was not met.
  kInterrupted = 130,  ///< Interrupted, everything done so far kept.
};

using Arguments = std::vector<std::string>;

/// One subcommand each: `arguments` are those after its name; the result is the exit code.
/// @throw HelpText for --help and --version; InputError, RunError as the libraries do.
int design_command(const Arguments& arguments);
int render_command(const Arguments& arguments);
int cam_command(const Arguments& arguments);
int nest_command(const Arguments& arguments);
int coupon_command(const Arguments& arguments);
int export_command(const Arguments& arguments);
int send_command(const Arguments& arguments);
int reflect_command(const Arguments& arguments);
int view_command(const Arguments& arguments);
int batch_command(const Arguments& arguments);
int info_command(const Arguments& arguments);

/// Occupies those of standard input, output and error that are closed, so that no file, port or
/// socket that is opened later takes their place and is written to by whatever prints. Reading and
/// writing them still fails. To be called before anything else; async-signal-safe.
void hold_standard_descriptors() noexcept;

/// Whether errors are to be told as JSON too: also where the command line is what is wrong.
bool wants_json(const std::vector<std::string>& arguments);

/// Runs the subcommand that `arguments` (without the program's name) asks for and returns the exit
/// code of docs/interface.md. Every error ends up as one line on stderr; nothing is thrown.
int run_command_line(const std::vector<std::string>& arguments) noexcept;

/// All that main() does: holds the standard descriptors, ignores the signals that writing raises,
/// and runs the command line.
int run_main(int argc, char** argv) noexcept;

}  // namespace lensforge::app
