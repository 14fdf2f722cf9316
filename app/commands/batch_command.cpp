// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <atomic>
#include <charconv>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "app/batch/batch_job.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "app/frame/option_set.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"

namespace lensforge::app {
namespace {

using Status = JobOutcome::Status;

struct BatchSettings {
  std::string jobs_file;
  std::string out;
  std::string shard = "1/1";
  std::string table;
  std::vector<std::string> grid;
  int parallel = 1;
  bool force = false;
  Arguments program;  ///< BatchPlace's.
};

constexpr int kMaxParallel = 1024;

void describe(Description& d, BatchSettings& settings) {
  d.text(
       "JOBS", settings.jobs_file, "",
       "JSON lines, a job each: {\"name\": \"a\", \"command\": \"design\", \"target\": "
       "\"a.png\", \"options\": {\"focal\": 250}, \"then\": [\"cam\", {\"command\": \"export\", "
       "\"options\": {\"out\": \"a.stl\"}}]}; first design or reflect, then cam, export or render")
      .needed = true;
  d.text("--out", settings.out, "DIR", "where every job gets a folder of its name").needed = true;
  d.text("--shard", settings.shard, "I/N", "of every N jobs only the I-th, I from 1 to N");
  d.texts("--grid", settings.grid, "OPTION=VALUES",
          "every job with every combination of these: focal=250,300 cam.pitch=0.05,0.06");
  d.whole("--parallel", settings.parallel, Limits::between(1, kMaxParallel),
          "jobs at the same time; they share --threads");
  d.text("--table", settings.table, "FILE.csv", "write all jobs' options and results into a table");
  d.flag("--force", settings.force,
         "do jobs again that were done with other options; replace a --table of other origin");
}

/// I of N.
struct Shard {
  int number = 1;
  int count = 1;

  [[nodiscard]] bool has(std::size_t job) const {
    return job % static_cast<std::size_t>(count) == static_cast<std::size_t>(number - 1);
  }
};

Shard read_shard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto number = std::from_chars(text.data(), end, shard.number);
  const bool slash = number.ec == std::errc() && number.ptr != end && *number.ptr == '/';
  const auto count = slash ? std::from_chars(number.ptr + 1, end, shard.count) : number;
  if (!slash || count.ec != std::errc() || count.ptr != end || shard.number < 1 ||
      shard.number > shard.count) {
    throw InputError("--shard " + text + ": I/N with I from 1 to N, such as 2/4");
  }
  return shard;
}

/// The jobs of this shard, several at a time.
class BatchRun {
 public:
  BatchRun(const std::vector<BatchJob>& jobs, const Shard& shard, const BatchPlace& place,
           const CommandFrame& frame)
      : jobs_(jobs), place_(place), frame_(frame), outcomes_(jobs.size()) {
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      if (shard.has(i)) mine_.push_back(i);
    }
  }

  void run(int parallel, const std::stop_token& stop) {
    std::vector<std::jthread> workers;
    const auto most = std::min<std::size_t>(static_cast<std::size_t>(parallel), mine_.size());
    for (std::size_t i = 0; i < most; ++i) {
      workers.emplace_back([this, &stop] { work(stop); });
    }
  }

  [[nodiscard]] const std::vector<std::size_t>& mine() const { return mine_; }
  [[nodiscard]] const std::vector<JobOutcome>& outcomes() const { return outcomes_; }
  [[nodiscard]] std::size_t count(Status status) const {
    return static_cast<std::size_t>(std::count_if(
        mine_.begin(), mine_.end(), [&](std::size_t i) { return outcomes_[i].status == status; }));
  }

 private:
  void work(const std::stop_token& stop) {
    for (std::size_t k = next_++; k < mine_.size() && !stop.stop_requested(); k = next_++) {
      JobOutcome& outcome = outcomes_[mine_[k]];
      outcome = run_job(jobs_[mine_[k]], place_, stop);
      tell(jobs_[mine_[k]], outcome);
    }
  }

  void tell(const BatchJob& job, const JobOutcome& outcome) {
    const std::scoped_lock lock(telling_);
    ++told_;
    frame_.console().note(std::to_string(told_) + "/" + std::to_string(mine_.size()) + " " +
                          job.name + ": " +
                          (outcome.earlier ? "was done before" : status_word(outcome.status)) +
                          (outcome.message.empty() ? "" : ", " + outcome.message) +
                          (outcome.earlier ? "" : ", " + fixed(outcome.seconds, 1) + " s"));
    frame_.report_to_host(
        {"batch", static_cast<double>(told_), static_cast<double>(mine_.size()), job.name});
  }

  const std::vector<BatchJob>& jobs_;
  const BatchPlace& place_;
  const CommandFrame& frame_;
  std::vector<std::size_t> mine_;
  std::vector<JobOutcome> outcomes_;
  std::atomic<std::size_t> next_ = 0;
  std::mutex telling_;
  std::size_t told_ = 0;
};

/// Table of all jobs of the file, including other shards'.
std::string table_of(const std::vector<BatchJob>& jobs, const BatchRun& run,
                     const BatchPlace& place) {
  std::vector<TableJob> rows;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const JobOutcome& outcome = run.outcomes()[i];
    TableJob row{jobs[i].json(), status_word(outcome.status), outcome.message,
                 job_record(jobs[i], place.out)};
    if (outcome.status == Status::kOpen && !row.record.is_null()) {
      row.status = row.record["status"];
      row.message = row.record["message"];
    }
    rows.push_back(std::move(row));
  }
  return job_table(rows);
}

nlohmann::json result_json(const BatchSettings& settings, const std::vector<BatchJob>& jobs,
                           const BatchRun& run) {
  nlohmann::json list = nlohmann::json::array();
  for (const std::size_t i : run.mine()) {
    const JobOutcome& outcome = run.outcomes()[i];
    list.push_back({{"name", jobs[i].name},
                    {"status", status_word(outcome.status)},
                    {"message", outcome.message},
                    {"earlier", outcome.earlier},
                    {"seconds", outcome.seconds}});
  }
  return {{"out", settings.out}, {"jobs", list}};
}

std::string result_text(const BatchSettings& settings, const std::vector<BatchJob>& jobs,
                        const BatchRun& run) {
  std::string text = settings.out + ":";
  for (const Status status : {Status::kDone, Status::kLimitMissed, Status::kFailed, Status::kBusy,
                              Status::kInterrupted, Status::kOpen}) {
    const std::size_t count = run.count(status);
    if (count > 0) text.append(" ").append(std::to_string(count) + " " + status_word(status) + ",");
  }
  text.back() = '\n';
  for (const std::size_t i : run.mine()) {
    const JobOutcome& outcome = run.outcomes()[i];
    if (outcome.status == Status::kFailed)
      text.append("  ").append(jobs[i].name + ": " + outcome.message + "\n");
  }
  return text;
}

int batch_exit_code(const BatchRun& run, const std::stop_token& stop) {
  if (stop.stop_requested()) return kInterrupted;
  if (run.count(Status::kFailed) + run.count(Status::kBusy) > 0) return kFailed;
  return run.count(Status::kLimitMissed) > 0 ? kLimitMissed : kDone;
}

CommandResult run(CommandFrame& frame, BatchSettings& settings) {
  const Shard shard = read_shard(settings.shard);
  std::vector<BatchJob> jobs = expanded(read_jobs(settings.jobs_file), read_grid(settings.grid));
  fingerprint_targets(jobs);
  const int threads = std::max(1, frame.options().executor().concurrency() / settings.parallel);
  const BatchPlace place{settings.out, settings.jobs_file, threads, settings.force,
                         settings.program};
  for (const BatchJob& job : jobs) require_room_for_job(job, place);
  if (!settings.table.empty()) {
    require_replaceable("--table", settings.table, settings.force || is_job_table(settings.table));
  }
  require_writable_folder(settings.out);
  frame.begin();
  frame.console().begin();
  BatchRun batch(jobs, shard, place, frame);
  batch.run(settings.parallel, frame.stop_token());
  if (!settings.table.empty()) write_whole_file(settings.table, table_of(jobs, batch, place));
  CommandResult result{result_json(settings, jobs, batch), result_text(settings, jobs, batch),
                       batch_exit_code(batch, frame.stop_token())};
  if (result.exit_code == kInterrupted) {
    result.notes.emplace_back("interrupted; the same command does what is open");
  }
  return result;
}

Command<BatchSettings> batch_verb() {
  return {"batch", "Does the jobs of a file, each in a folder of its own.", run};
}

}  // namespace

int batch_command(const Arguments& arguments) { return run_command(batch_verb(), arguments); }

CommandCall batch_call(const Arguments& program) {
  BatchSettings settings;
  settings.program = program;
  return call_of(batch_verb(), settings);
}

}  // namespace lensforge::app
