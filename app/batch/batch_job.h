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

  /// Whether the command has such an option. @param name  without dashes.
  [[nodiscard]] bool has_option(const std::string& name) const;
  /// @throw InputError naming option, value and rule: no such option of the command, one that batch
  ///        sets itself, or a value that the command's option table refuses.
  void set(const std::string& name, const nlohmann::json& value);
  /// The options as words of a command line: a flag if it is true, an array as several words.
  [[nodiscard]] Arguments words() const;
};

/// One line of a jobs file.
struct BatchJob {
  std::string name;    ///< Of its folder.
  std::string target;  ///< Picture or mesh; relative to the folder that batch was called from.
  std::vector<BatchStep> steps;
  std::string target_sha256 = {};  ///< Of its content; empty until fingerprint_targets().

  /// What was asked for, to tell whether a folder is of this very job: what is the same has the
  /// same outcome.
  [[nodiscard]] nlohmann::json json() const;
};

/// Reads JSON lines: {"name": …, "command": "design"|"reflect", "target": …, "options": {…},
/// "then": ["cam", {"command": "export", "options": {…}}]}. Only a design can be followed by
/// others: cam, export and render. Empty lines are passed over.
/// @throw InputError naming file, line and rule: no JSON, an unknown key or command, a name twice
///        or that is no file name, options as BatchStep::set() does.
std::vector<BatchJob> read_jobs(const std::filesystem::path& path);

/// Reads every target once, however many jobs have it. @throw InputError if one cannot be read.
void fingerprint_targets(std::vector<BatchJob>& jobs);

/// An option and the values that it takes in turn.
struct GridAxis {
  std::string command;  ///< Empty: the job's first command that has the option.
  std::string option;
  std::vector<std::string> values;
};

/// Reads "focal=250,300" and "cam.pitch=0.05,0.06". @throw InputError naming word and rule.
std::vector<GridAxis> read_grid(const std::vector<std::string>& words);

/// Every job with every combination of values, the last axis fastest. A job's name takes what it is
/// given: "portrait-focal250-pitch0.05".
/// @throw InputError if none of a job's commands has an option, or two names become the same.
std::vector<BatchJob> expanded(const std::vector<BatchJob>& jobs,
                               const std::vector<GridAxis>& axes);

}  // namespace lensforge::app
