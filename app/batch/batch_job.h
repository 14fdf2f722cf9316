// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stop_token>
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

/// File in every finished job's folder: the job, the results of its steps, and its status.
inline constexpr const char* kJobFile = "job.json";
/// Output of the job's commands.
inline constexpr const char* kJobLog = "job.log";

/// Status of a job.
struct JobOutcome {
  enum class Status {
    kOpen,         ///< Not done yet, no failure.
    kDone,         ///< Finished; its folder exists.
    kLimitMissed,  ///< Finished, but a command missed a stated limit (exit code 3).
    kFailed,       ///< A command failed; the next run repeats it.
    kBusy,         ///< Another batch is running it.
    kInterrupted,
  };
  Status status = Status::kOpen;
  std::string message;   ///< Reason of the failure, or the limit that was missed.
  bool earlier = false;  ///< An earlier run had finished it.
  double seconds = 0.0;  ///< Run time of all its commands.

  [[nodiscard]] bool finished() const {
    return status == Status::kDone || status == Status::kLimitMissed;
  }
};

std::string status_word(JobOutcome::Status status);

/// Files and settings of a batch.
struct BatchPlace {
  std::filesystem::path out;  ///< Holds a folder for each finished job, and `.work` for the others.
  std::string jobs_file;      ///< For messages.
  int threads = 0;            ///< For commands that do not set it; 0: the command's default.
  bool force = false;         ///< Repeat jobs that were done with other options.
  Arguments program = {};     ///< Words that start a command; none: this very program.
};

/// Returns this job's job.json, finished or not: "status", "message", "seconds" of the finished
/// commands, "steps" with their results. Null if the job was never started.
nlohmann::json job_record(const BatchJob& job, const std::filesystem::path& out);

/// @throw InputError if the job's folder exists and belongs to another job (unless `place.force`)
///        or was not written by batch.
void require_room_for_job(const BatchJob& job, const BatchPlace& place);

/// Runs a job in `.work/NAME` and renames the folder when the job is done: a folder NAME is always
/// complete. Finished commands are not repeated; an interrupted design continues from its
/// checkpoint. Failures of commands or of the disk are reported in the result, not thrown.
/// @pre fingerprint_targets()
JobOutcome run_job(const BatchJob& job, const BatchPlace& place, const std::stop_token& stop);

/// A row of the table: a job and its result.
struct TableJob {
  nlohmann::json job;  ///< BatchJob::json()
  std::string status;  ///< status_word()
  std::string message;
  nlohmann::json record;  ///< job_record()
};

/// The jobs as CSV (RFC 4180): name, status, message, seconds, then every option that any job has
/// ("design.focal") and every number, word and truth value of the commands' results
/// ("design.metrics.smooth.mae"), empty where a job has none. Results that only repeat a command's
/// options are left out.
std::string job_table(const std::vector<TableJob>& jobs);

/// True if the file begins like a table of jobs.
bool is_job_table(const std::filesystem::path& file);

}  // namespace lensforge::app
