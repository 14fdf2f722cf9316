// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/frame/command_line.h"

namespace lensforge::app {

/// One command of a job.
struct BatchStep {
  std::string command;     ///< "design", "cam", …
  nlohmann::json options;  ///< An object: option names without dashes, and their values.

  /// True if the command has this option. @param name  without dashes.
  [[nodiscard]] bool has_option(const std::string& name) const;
  /// @throw InputError naming option, value and rule: an option that the command lacks or that
  ///        batch sets itself, or a value that the command's option table refuses.
  void set(const std::string& name, const nlohmann::json& value);
  /// The options as words of a command line: a flag if it is true, an array as several words.
  [[nodiscard]] Arguments words() const;
};

/// One line of a jobs file.
struct BatchJob {
  std::string name;    ///< Also the folder's name.
  std::string target;  ///< Picture or mesh; relative to the folder that batch was called from.
  std::vector<BatchStep> steps;
  std::string target_sha256 = {};  ///< Hash of the content; empty until fingerprint_targets().

  /// The job as requested. Two jobs with equal JSON have the same result; it is compared with that
  /// of an existing folder.
  [[nodiscard]] nlohmann::json json() const;
};

/// Reads JSON lines: {"name": …, "command": "design"|"reflect", "target": …, "options": {…},
/// "then": ["cam", {"command": "export", "options": {…}}]}. Only a design can be followed by other
/// commands: cam, export and render. Empty lines are skipped.
/// @throw InputError naming file, line and rule: invalid JSON, an unknown key or command, a name
///        that is repeated or is no file name, an option that BatchStep::set() refuses.
std::vector<BatchJob> read_jobs(const std::filesystem::path& path);

/// Hashes the targets; reads each file once, even if several jobs share it. @throw InputError if
/// one cannot be read.
void fingerprint_targets(std::vector<BatchJob>& jobs);

/// An option and the list of its values.
struct GridAxis {
  std::string command;  ///< Empty: the job's first command that has the option.
  std::string option;
  std::vector<std::string> values;
};

/// Reads "focal=250,300" and "cam.pitch=0.05,0.06". @throw InputError naming word and rule.
std::vector<GridAxis> read_grid(const std::vector<std::string>& words);

/// Returns every job with every combination of values; the last axis varies fastest. The values are
/// appended to the job's name: "portrait-focal250-pitch0.05".
/// @throw InputError if none of a job's commands has an option, or two names become the same.
std::vector<BatchJob> expanded(const std::vector<BatchJob>& jobs,
                               const std::vector<GridAxis>& axes);

}  // namespace lensforge::app
