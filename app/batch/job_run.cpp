// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/job_run.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "app/frame/child_command.h"
#include "app/frame/command_line.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/text/version.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using Status = JobOutcome::Status;

constexpr const char* kWork = ".work";
constexpr const char* kLens = "out";  ///< In a job's work folder: what gets its name.
constexpr const char* kOld = "old";   ///< The replaced folder.
constexpr const char* kStepOutput = "step.json";
constexpr const char* kFormat = "lensforge.job";

/// A command that was interrupted with its batch ends within a second and then lets go of the
/// folder.
constexpr int kAttempts = 100;
constexpr std::chrono::milliseconds kBetweenAttempts{50};

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// job.json in the job's folder or in that of its work; null if there is none.
json record_in(const fs::path& folder) {
  json record = json_in(folder / kJobFile);
  return record.is_object() && record.value("format", "") == kFormat ? record : json();
}

bool is_of(const json& record, const BatchJob& job) {
  return record.is_object() && record.value("job", json()) == job.json();
}

JobOutcome outcome_of(const json& record, bool earlier) {
  const bool missed = record["status"] == "limit";
  return {missed ? Status::kLimitMissed : Status::kDone, record["message"], earlier,
          record["seconds"]};
}

/// One job's work folder while a batch holds it.
class JobWork {
 public:
  JobWork(const BatchJob& job, const BatchPlace& place, const std::stop_token& stop)
      : job_(job),
        place_(place),
        stop_(stop),
        folder_(place.out / kWork / job.name),
        lens_(folder_ / kLens),
        lock_(std::move(*FolderLock::make(folder_, FolderLock::Kind::kExclusive).lock)) {}

  JobOutcome run() {
    // Another batch may have done it in the meantime.
    const json done = record_in(place_.out / job_.name);
    if (is_of(done, job_)) {
      clear();
      return outcome_of(done, true);
    }
    take_up();
    for (std::size_t i = record_["steps"].size(); i < job_.steps.size(); ++i) {
      if (stop_.stop_requested()) return {Status::kInterrupted, "", false, 0.0};
      const std::optional<JobOutcome> end = do_step(job_.steps[i]);
      if (end) return *end;
    }
    return publish();
  }

 private:
  /// Continues an earlier batch's work on the same job, or begins.
  void take_up() {
    wait_for_lens();
    record_ = record_in(folder_);
    if (is_of(record_, job_)) return;
    fs::remove_all(lens_);
    fs::remove(folder_ / kJobLog);
    record_ = {{"format", kFormat},         {"version", 1},
               {"job", job_.json()},        {"steps", json::array()},
               {"program", program_mark()}, {"seconds", 0.0}};
    set_status("open", "");
    save();
  }

  /// A command of a batch that was killed may still be ending.
  void wait_for_lens() const {
    if (!is_folder(lens_)) return;
    for (int i = 0;; ++i) {
      try {
        const FolderLock once(lens_, FolderLock::Kind::kExclusive);
        return;
      } catch (const FolderHeld&) {
        if (i == kAttempts) throw;
        std::this_thread::sleep_for(kBetweenAttempts);
      }
    }
  }

  void save() const { write_whole_file(folder_ / kJobFile, record_.dump(2) + "\n"); }

  [[nodiscard]] Arguments words_of(const BatchStep& step) const {
    const std::string out = lens_.string();
    Arguments words{step.command};
    const bool first = step.command == "design" || step.command == "reflect";
    if (first) {
      words.insert(words.end(), {job_.target, "--out", out});
      words.emplace_back(step.has_option("resume") && is_folder(lens_) ? "--resume" : "--force");
    } else {
      words.push_back(out);
    }
    BatchStep said = step;
    if (step.command == "export") {
      const std::string file = step.options.value("out", "lens.step");
      words.insert(words.end(), {"--out", (lens_ / fs::path(file).filename()).string()});
      said.options.erase("out");
    }
    if (place_.threads > 0 && !step.options.contains("threads")) {
      words.insert(words.end(), {"--threads", std::to_string(place_.threads)});
    }
    words.emplace_back("--json");
    const Arguments more = said.words();
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  /// @return how the job ends, if it ends here.
  std::optional<JobOutcome> do_step(const BatchStep& step) {
    const fs::path log = folder_ / kJobLog;
    std::error_code ignored;
    const std::uintmax_t before = fs::exists(log, ignored) ? fs::file_size(log, ignored) : 0;
    const ChildEnd end =
        run_child({place_.program, words_of(step), folder_ / kStepOutput, log}, stop_);
    if (stop_.stop_requested() && end.exit_code == kInterrupted) {
      return JobOutcome{Status::kInterrupted, "", false, end.seconds};
    }
    const std::string said = last_line(content_of(log).substr(before));
    if (end.exit_code != kDone && end.exit_code != kLimitMissed) {
      set_status("failed",
                 step.command + ": " +
                     (said.empty() ? "exit code " + std::to_string(end.exit_code) : said));
      save();
      return JobOutcome{Status::kFailed, record_["message"], false,
                        record_["seconds"].get<double>() + end.seconds};
    }
    record_["steps"].push_back({{"command", step.command},
                                {"exit_code", end.exit_code},
                                {"message", end.exit_code == kLimitMissed ? said : ""},
                                {"seconds", end.seconds},
                                {"result", json_in(folder_ / kStepOutput)}});
    record_["seconds"] = record_["seconds"].get<double>() + end.seconds;
    set_status("open", "");
    save();
    return std::nullopt;
  }

  void set_status(const std::string& status, const std::string& message) {
    record_["status"] = status;
    record_["message"] = message;
  }

  /// The rename is what makes the job done.
  JobOutcome publish() {
    set_status("done", "");
    for (const json& step : record_["steps"]) {
      if (step["exit_code"] != kLimitMissed) continue;
      set_status("limit",
                 step["command"].get<std::string>() + ": " + step["message"].get<std::string>());
    }
    write_whole_file(lens_ / kJobFile, record_.dump(2) + "\n");
    fs::copy_file(folder_ / kJobLog, lens_ / kJobLog, fs::copy_options::overwrite_existing);
    const fs::path place = place_.out / job_.name;
    fs::remove_all(folder_ / kOld);
    if (fs::exists(place)) fs::rename(place, folder_ / kOld);
    fs::rename(lens_, place);
    clear();
    return outcome_of(record_, false);
  }

  void clear() const {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  const BatchJob& job_;
  const BatchPlace& place_;
  const std::stop_token& stop_;
  fs::path folder_;
  fs::path lens_;
  FolderLock lock_;
  json record_;
};

}  // namespace

std::string status_word(JobOutcome::Status status) {
  switch (status) {
    case Status::kDone:
      return "done";
    case Status::kLimitMissed:
      return "limit";
    case Status::kFailed:
      return "failed";
    case Status::kBusy:
      return "busy";
    case Status::kInterrupted:
      return "interrupted";
    case Status::kOpen:
      break;
  }
  return "open";
}

json job_record(const BatchJob& job, const fs::path& out) {
  for (const fs::path& folder : {out / job.name, out / kWork / job.name}) {
    json record = record_in(folder);
    if (is_of(record, job)) return record;
  }
  return {};
}

void require_room_for(const BatchJob& job, const BatchPlace& place) {
  const fs::path folder = place.out / job.name;
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) return;
  const json record = record_in(folder);
  if (record.is_null()) {
    throw InputError(folder.string() + ": is there and is no job's; give job \"" + job.name +
                     "\" of " + place.jobs_file + " another name");
  }
  if (!place.force && !is_of(record, job)) {
    throw InputError(folder.string() +
                     ": was done with other options or another picture than job \"" + job.name +
                     "\" of " + place.jobs_file +
                     " has now; --force does it again, another name keeps both");
  }
}

JobOutcome run_job(const BatchJob& job, const BatchPlace& place, const std::stop_token& stop) {
  try {
    return JobWork(job, place, stop).run();
  } catch (const FolderHeld& e) {
    return {Status::kBusy, e.what(), false, 0.0};
  } catch (const std::exception& e) {
    return {Status::kFailed, e.what(), false, 0.0};
  }
}

namespace {

/// First columns of every table.
const std::vector<std::string> kFirstColumns{"name", "status", "message", "seconds"};

/// Columns in the order in which they first came after kFirstColumns, and a row's cells.
class Table {
 public:
  using Cells = std::map<std::string, std::string>;

  void add(Cells& row, const std::string& column, const std::string& value) {
    if (std::find(columns_.begin(), columns_.end(), column) == columns_.end()) {
      columns_.push_back(column);
    }
    row[column] = value;
  }
  void end_row(Cells row) { rows_.push_back(std::move(row)); }

  /// The names of the columns so far, without the line's end.
  [[nodiscard]] std::string head() const {
    return line(columns_, [](const std::string& column) { return column; });
  }
  [[nodiscard]] std::string text() const {
    std::string text = head() + "\r\n";
    for (const Cells& row : rows_) {
      const auto cell = [&](const std::string& column) {
        const auto found = row.find(column);
        return found == row.end() ? std::string() : found->second;
      };
      text += line(columns_, cell) + "\r\n";
    }
    return text;
  }

 private:
  static std::string quoted(const std::string& cell) {
    if (cell.find_first_of(",\"\r\n") == std::string::npos) return cell;
    std::string text = "\"";
    for (const char c : cell) text.append(c == '"' ? 2 : 1, c);
    return text + "\"";
  }
  template <class CellOf>
  static std::string line(const std::vector<std::string>& columns, const CellOf& cell) {
    std::string text;
    for (const std::string& column : columns) {
      if (!text.empty()) text += ',';
      text += quoted(cell(column));
    }
    return text;
  }

  std::vector<std::string> columns_ = kFirstColumns;
  std::vector<Cells> rows_;
};

std::string cell_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// Every value within objects; lists are no single values and are left out.
void add_values(const std::string& prefix, const json& value, Table& table, Table::Cells& row) {
  if (value.is_object()) {
    for (const auto& [key, inner] : value.items()) {
      const bool repeats = key == "options" || key == "command" || key == "out";
      if (!repeats) add_values(std::string(prefix).append(".").append(key), inner, table, row);
    }
  } else if (!value.is_array() && !value.is_null()) {
    table.add(row, prefix, cell_of(value));
  }
}

void add_options(const json& steps, Table& table, Table::Cells& row) {
  for (const json& step : steps) {
    for (const auto& [key, value] : step["options"].items()) {
      table.add(row, step["command"].get<std::string>() + "." + key, cell_of(value));
    }
  }
}

void add_results(const json& steps, Table& table, Table::Cells& row) {
  for (const json& step : steps) add_values(step["command"], step["result"], table, row);
}

}  // namespace

std::string job_table(const std::vector<TableJob>& jobs) {
  Table table;
  for (const TableJob& job : jobs) {
    Table::Cells row;
    table.add(row, "name", job.job["name"]);
    table.add(row, "status", job.status);
    table.add(row, "message", job.message);
    add_options(job.job["steps"], table, row);
    if (!job.record.is_null()) {
      table.add(row, "seconds", job.record["seconds"].dump());
      add_results(job.record["steps"], table, row);
    }
    table.end_row(std::move(row));
  }
  return table.text();
}

bool is_job_table(const std::filesystem::path& file) {
  const std::string head = Table().head();
  std::string begin(head.size(), '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == head;
}

}  // namespace lensforge::app
