// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/commands.h"

namespace lensforge::app {

/// One command of a job.
struct BatchStep {
  std::string command;     ///< "design", "cam", …
  nlohmann::json options;  ///< An object: option names without dashes, and their values.

  /// Whether the command has such an option. @param name  without dashes.
  [[nodiscard]] bool knows(const std::string& name) const;
  /// The options as words of a command line: true as a flag, an array as several words.
  [[nodiscard]] Arguments words() const;
};

/// One line of a jobs file.
struct BatchJob {
  std::string name;    ///< Of its folder.
  std::string target;  ///< Picture or mesh; relative to the folder that batch was called from.
  std::vector<BatchStep> steps;

  /// What was asked for, to tell whether a folder is of this very job.
  [[nodiscard]] nlohmann::json json() const;
};

/// Reads JSON lines: {"name": …, "command": "design"|"reflect", "target": …, "options": {…},
/// "then":
/// ["cam", {"command": "export", "options": {…}}]}. Only a design can be followed by others: cam,
/// export and render. Empty lines are passed over.
/// @throw InputError naming file, line and rule: no JSON, an unknown key, command or option, a name
///        twice or that is no file name, a value that is no word.
std::vector<BatchJob> read_jobs(const std::filesystem::path& path);

/// Whether a job's folder can have this name: letters, digits, '.', '_' and '-', not starting with
/// '.' or '-', at most 200 of them.
bool is_job_name(const std::string& name);

/// @throw InputError if the names of two jobs are the same. @param file  for the message.
void require_different_names(const std::vector<BatchJob>& jobs, const std::string& file);

}  // namespace lensforge::app
