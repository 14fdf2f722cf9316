// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge::app {

/// Exit codes of the command (docs/interface.md, "Exit codes").
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,         ///< It failed while running.
  kBadInput = 2,       ///< Bad usage or bad input.
  kLimitMissed = 3,    ///< Done, but a stated quality or safety limit was not met.
  kInterrupted = 130,  ///< Interrupted; finished work is kept.
};

using Arguments = std::vector<std::string>;

/// One subcommand each: `arguments` are those after its name; the result is the exit code.
/// @throw HelpText for --help and --version; InputError, RunError as the libraries do.
int design_command(const Arguments& arguments);
int render_command(const Arguments& arguments);
int cam_command(const Arguments& arguments);
int nest_command(const Arguments& arguments);
int coupon_command(const Arguments& arguments);
int check_command(const Arguments& arguments);
int export_command(const Arguments& arguments);
int send_command(const Arguments& arguments);
int studio_command(const Arguments& arguments);
int reflect_command(const Arguments& arguments);
int plan_command(const Arguments& arguments);
int view_command(const Arguments& arguments);
int batch_command(const Arguments& arguments);
int info_command(const Arguments& arguments);

/// Occupies those of standard input, output and error that are closed. Otherwise a file, port or
/// socket opened later would get their number and receive printed text. Reading and writing them
/// still fails. Call this first; async-signal-safe.
void hold_standard_descriptors() noexcept;

/// True if errors are printed as JSON too, even for an invalid command line.
bool wants_json(const std::vector<std::string>& arguments);

/// Runs the subcommand named in `arguments` (without the program's name) and returns the exit code
/// (docs/interface.md). Every error becomes one line on stderr; nothing is thrown.
int run_command_line(const std::vector<std::string>& arguments) noexcept;

/// The body of main(): holds the standard descriptors, ignores the signals that writing raises, and
/// runs the command line.
int run_main(int argc, char** argv) noexcept;

}  // namespace lensforge::app
