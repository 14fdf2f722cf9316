// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "app/batch/batch_job.h"

namespace lensforge::app {

/// What every folder of a finished job has: the job, its steps' results, and how it ended.
inline constexpr const char* kJobFile = "job.json";
/// What its commands said.
inline constexpr const char* kJobLog = "job.log";

/// How things stand with a job.
struct JobOutcome {
  enum class Status {
    kOpen,         ///< Not done, and nothing has gone wrong.
    kDone,         ///< Its folder is there.
    kLimitMissed,  ///< The same; a command missed a stated limit (exit code 3).
    kFailed,       ///< A command failed; the next run repeats it.
    kBusy,         ///< Another batch is at work on it.
    kInterrupted,
  };
  Status status = Status::kOpen;
  std::string message;   ///< Why it failed, or which limit was missed.
  bool earlier = false;  ///< It had been done before.
  double seconds = 0.0;  ///< Of all its commands.

  [[nodiscard]] bool finished() const {
    return status == Status::kDone || status == Status::kLimitMissed;
  }
};

std::string status_word(JobOutcome::Status status);

/// Where a batch does its work.
struct BatchPlace {
  std::filesystem::path out;  ///< A folder for each job that is done, and `.work` for the others.
  std::string jobs_file;      ///< For messages.
  int threads = 0;            ///< Of every command that does not say so itself; 0 leaves it to it.
  bool force = false;         ///< Jobs that were done with other options are done again.
};

/// What job.json says of this very job, finished or not: "status", "message", "seconds" of the
/// commands that were done, "steps" with their results. Null before anybody began with it.
nlohmann::json job_record(const BatchJob& job, const std::filesystem::path& out);

/// @throw InputError if the job's folder is there and is not of this very job: another job's
///        without `place.force`, or somebody else's.
void require_room_for(const BatchJob& job, const BatchPlace& place);

/// Does a job in `.work/NAME` and gives it its name in one step when it is done, so that a folder
/// NAME is always whole. A command that was finished before is not run again, an interrupted design
/// goes on from its checkpoint. Never throws for what a command or the disk does.
/// @pre fingerprint_targets()
JobOutcome run_job(const BatchJob& job, const BatchPlace& place, const std::stop_token& stop);

/// A row of the table: what was asked for and what came of it.
struct TableJob {
  nlohmann::json job;  ///< BatchJob::json()
  std::string status;  ///< status_word()
  std::string message;
  nlohmann::json record;  ///< job_record()
};

/// The jobs as CSV (RFC 4180): name, status, message, seconds, then every option that any job has
/// ("design.focal") and every number, word and truth value of the commands' results
/// ("design.metrics.smooth.mae"), empty where a job has none. What a command repeats of how it was
/// called is left out.
std::string job_table(const std::vector<TableJob>& jobs);

/// Whether the file begins as a table of jobs does.
bool is_job_table(const std::filesystem::path& file);

}  // namespace lensforge::app
