// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <stop_token>

#include "app/commands.h"

namespace lensforge::app {

/// How a command ended that was run as a process of its own.
struct StepEnd {
  int exit_code = 0;  ///< 128 + the signal's number if a signal ended it.
  double seconds = 0.0;
};

/// Runs this very program with `words`, its output going to two files: `out` is replaced, `log` is
/// added to. When `stop` is requested, or the calling thread ends, it is interrupted as by Ctrl-C.
/// @throw RunError with the system's reason if no process can be made or a file not be written.
StepEnd run_step(const Arguments& words, const std::filesystem::path& out,
                 const std::filesystem::path& log, const std::stop_token& stop);

}  // namespace lensforge::app
