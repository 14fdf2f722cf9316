// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lensforge::bench {

/// A child process's exit and resource usage.
struct ChildResult {
  int exit_code = -1;  ///< −1 if a signal ended it.
  int signal = 0;
  double wall_seconds = 0.0;
  double cpu_seconds = 0.0;  ///< User and system time of all its threads.
  double peak_mib = 0.0;     ///< Largest resident set; never less than the caller's own.
};

/// Runs `words` (a program and its arguments) to its end, its output going to two files.
/// @throw RunError with the system's reason if no process can be made.
ChildResult run_child(const std::vector<std::string>& words, const std::filesystem::path& out,
                      const std::filesystem::path& err);

}  // namespace lensforge::bench
