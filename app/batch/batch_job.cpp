// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/batch_job.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stop_token>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "app/frame/child_command.h"
#include "app/frame/command_line.h"
#include "app/frame/option_set.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/schema/description.h"
#include "core/schema/json.h"
#include "core/text/number_text.h"
#include "core/text/version.h"

namespace lensforge::app {
namespace {

using Json = nlohmann::json;

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{64} << 20U;
constexpr std::size_t kMaxName = 200;

/// True if a job's folder can have this name: letters, digits, '.', '_' and '-', not starting with
/// '.' or '-', at most 200 of them.
bool is_job_name(const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kMaxName && name[0] != '.' && name[0] != '-' &&
         std::all_of(name.begin(), name.end(), allowed);
}

/// A command of a job, and what reads its options.
struct JobCommand {
  std::string_view name;
  int (*run)(const Arguments&);
  bool first;  ///< Makes the folder; the others work on a design's.
};

constexpr std::array kCommands{
    JobCommand{"design", design_command, true}, JobCommand{"reflect", reflect_command, true},
    JobCommand{"cam", cam_command, false}, JobCommand{"export", export_command, false},
    JobCommand{"render", render_command, false}};

const JobCommand* command_named(const std::string& name) {
  const auto found = std::find_if(kCommands.begin(), kCommands.end(),
                                  [&](const JobCommand& c) { return c.name == name; });
  return found == kCommands.end() ? nullptr : found;
}

/// True for options that batch itself sets.
bool is_for_batch(const std::string& option) {
  static const std::set<std::string> reserved{"config", "force", "help",   "help-all", "json",
                                              "out",    "quiet", "resume", "version"};
  return reserved.contains(option);
}

using FieldSpecs = std::map<std::string, FieldSpec>;

/// The options of a command by their names without dashes.
FieldSpecs listed_specs(const JobCommand& command) {
  FieldSpecs specs;
  try {
    command.run({kListOptions});
  } catch (const ListedOptions& listed) {
    for (const FieldSpec& spec : listed.options) {
      if (spec.name.starts_with("--")) specs[spec.name.substr(2)] = spec;
    }
  }
  return specs;
}

/// Those of all commands are listed at once: jobs ask from several threads.
const FieldSpecs& specs_of(const std::string& command) {
  static const std::map<std::string_view, FieldSpecs> known = [] {
    std::map<std::string_view, FieldSpecs> all;
    for (const JobCommand& each : kCommands) all[each.name] = listed_specs(each);
    return all;
  }();
  return known.at(command);
}

std::string word_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// @throw InputError unless the option can have this value.
void require_value(const FieldSpec& spec, const Json& value) {
  const auto is_word = [](const Json& v) { return v.is_string() || v.is_number(); };
  const bool flag = spec.kind == FieldKind::kFlag;
  const bool list = value.is_array() && spec.kind == FieldKind::kText;
  const bool fits = flag   ? value.is_boolean()
                    : list ? std::all_of(value.begin(), value.end(), is_word)
                           : is_word(value);
  if (!fits) {
    throw InputError(spec.name + " " + value.dump() + ": must be " +
                     (flag ? "true or false"
                           : "a text or a number, or a list of them where the option takes several "
                             "words; --grid makes a job of each of several values"));
  }
  if (!flag && !list) value_of(spec, word_of(value));
}

/// Reads one line.
class JobLine {
 public:
  JobLine(const Json& line, const std::string& where) : fields_(line, where), where_(where) {
    for (const auto& [key, value] : line.items()) {
      if (key != "name" && key != "command" && key != "target" && key != "options" &&
          key != "then") {
        refuse("'" + key + "'", "no such key; a job has name, command, target, options and then");
      }
    }
  }

  BatchJob job() {
    BatchJob job;
    job.name = fields_.text("name");
    if (!is_job_name(job.name)) {
      fields_.refuse(
          "name", "up to 200 letters, digits, '.', '_' and '-' that do not begin with '.' or '-'");
    }
    job.target = fields_.text("target");
    const std::string command = fields_.text("command");
    job.steps.push_back(step(command, options_of(fields_), true));
    if (fields_.has("then")) add_further(fields_.at("then"), job);
    return job;
  }

 private:
  [[noreturn]] void refuse(const std::string& what, const std::string& rule) const {
    throw InputError(where_ + ": " + what + ": " + rule);
  }

  static Json options_of(const JsonFields& fields) {
    if (!fields.has("options")) return Json::object();
    const Json& options = fields.at("options");
    if (!options.is_object()) fields.refuse("options", "an object of option names and values");
    return options;
  }

  void add_further(const Json& then, BatchJob& job) const {
    if (!then.is_array()) fields_.refuse("then", "a list of commands");
    if (!then.empty() && job.steps.front().command != "design") {
      refuse("then", "only a design can be followed by other commands");
    }
    for (const Json& next : then) {
      if (next.is_string()) {
        job.steps.push_back(step(next.get<std::string>(), Json::object(), false));
      } else {
        const JsonFields fields(next, where_, "then.");
        job.steps.push_back(step(fields.text("command"), options_of(fields), false));
      }
    }
  }

  [[nodiscard]] BatchStep step(const std::string& name, const Json& options, bool first) const {
    const JobCommand* command = command_named(name);
    if (command == nullptr || command->first != first) {
      refuse("command " + Json(name).dump(),
             first ? "design or reflect" : "cam, export or render after a design");
    }
    BatchStep step{name, Json::object()};
    for (const auto& [key, value] : options.items()) set(step, key, value);
    return step;
  }

  void set(BatchStep& step, const std::string& key, const Json& value) const {
    try {
      step.set(key, value);
    } catch (const InputError& e) {
      throw InputError(where_ + ": " + e.what());
    }
  }

  JsonFields fields_;
  std::string where_;
};

}  // namespace

bool BatchStep::has_option(const std::string& name) const {
  return specs_of(command).contains(name);
}

void BatchStep::set(const std::string& name, const Json& value) {
  const auto refuse = [&](const std::string& rule) {
    throw InputError("option '" + name + "' of " + command + ": " + rule);
  };
  const bool output = name == "out" && command == "export";
  if (is_for_batch(name) && !output) refuse("is set by batch itself");
  if (!has_option(name)) refuse("no such option; write it without dashes, as in --help");
  try {
    require_value(specs_of(command).at(name), value);
  } catch (const InputError& e) {
    throw InputError(command + " " + e.what());
  }
  if (output && !is_job_name(word_of(value))) {
    refuse("is " + value.dump() + ", must be the name of a file in the job's folder");
  }
  options[name] = value;
}

Arguments BatchStep::words() const {
  Arguments words;
  for (const auto& [key, value] : options.items()) {
    if (value == Json(false)) continue;
    words.push_back("--" + key);
    if (value.is_boolean()) continue;
    if (!value.is_array()) {
      words.push_back(word_of(value));
      continue;
    }
    for (const Json& part : value) words.push_back(word_of(part));
  }
  return words;
}

nlohmann::json BatchJob::json() const {
  nlohmann::json all = nlohmann::json::array();
  for (const BatchStep& step : steps) {
    all.push_back({{"command", step.command}, {"options", step.options}});
  }
  return {{"name", name}, {"target", target}, {"target_sha256", target_sha256}, {"steps", all}};
}

namespace {

/// @throw InputError if the names of two jobs are the same. @param file  for the message.
void require_different_names(const std::vector<BatchJob>& jobs, const std::string& file) {
  std::set<std::string> names;
  for (const BatchJob& job : jobs) {
    if (!names.insert(job.name).second) {
      throw InputError(file + ": name \"" + job.name + "\": two jobs have it, each needs its own");
    }
  }
}

}  // namespace

std::vector<BatchJob> read_jobs(const std::filesystem::path& path) {
  std::istringstream lines(read_whole_file(path, kMaxBytes));
  std::vector<BatchJob> jobs;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::string where = path.string() + " line " + std::to_string(number);
    const Json parsed = parse_json(line, where);
    jobs.push_back(JobLine(parsed, where).job());
  }
  if (jobs.empty()) throw InputError(path.string() + ": holds no job, one JSON object a line");
  require_different_names(jobs, path.string());
  return jobs;
}

void fingerprint_targets(std::vector<BatchJob>& jobs) {
  std::map<std::string, std::string> sums;
  for (BatchJob& job : jobs) {
    std::string& sum = sums[job.target];
    try {
      if (sum.empty()) sum = sha256_of(job.target);
    } catch (const InputError& e) {
      throw InputError("target of job \"" + job.name + "\": " + e.what());
    }
    job.target_sha256 = sum;
  }
}

namespace {

/// The value as part of a file name.
std::string name_part(const GridAxis& axis, const std::string& value) {
  std::string part = "-" + axis.option + value;
  for (char& c : part) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '-') c = '_';
  }
  return part;
}

/// "true" and "false" turn a flag on and off.
nlohmann::json grid_value(const std::string& text) {
  return text == "true" || text == "false" ? nlohmann::json(text == "true") : nlohmann::json(text);
}

BatchStep& step_of(const GridAxis& axis, BatchJob& job) {
  for (BatchStep& step : job.steps) {
    const bool meant = axis.command.empty() || axis.command == step.command;
    if (meant && step.has_option(axis.option)) return step;
  }
  throw InputError((axis.command.empty() ? "no command" : "no " + axis.command) + " of job \"" +
                   job.name + "\" has this option");
}

BatchJob with(const BatchJob& job, const GridAxis& axis, const std::string& value) {
  BatchJob made = job;
  try {
    step_of(axis, made).set(axis.option, grid_value(value));
  } catch (const InputError& e) {
    throw InputError("--grid " + axis.option + "=" + value + ": " + e.what());
  }
  made.name += name_part(axis, value);
  if (!is_job_name(made.name)) {
    throw InputError("--grid " + axis.option + ": the name " + made.name + " is too long");
  }
  return made;
}

GridAxis read_axis(const std::string& word) {
  const auto refuse = [&](const std::string& rule) {
    throw InputError("--grid " + word + ": " + rule +
                     ", such as focal=250,300 or cam.pitch=0.05,0.06");
  };
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos) refuse("an option, '=' and its values");
  GridAxis axis;
  axis.option = word.substr(0, equals);
  const std::size_t dot = axis.option.find('.');
  if (dot != std::string::npos) {
    axis.command = axis.option.substr(0, dot);
    axis.option = axis.option.substr(dot + 1);
  }
  std::istringstream values(word.substr(equals + 1));
  for (std::string value; std::getline(values, value, ',');) axis.values.push_back(value);
  const bool gap = std::any_of(axis.values.begin(), axis.values.end(),
                               [](const std::string& value) { return value.empty(); });
  if (axis.option.empty() || axis.values.empty() || gap)
    refuse("needs a name and values without gaps");
  return axis;
}

}  // namespace

std::vector<GridAxis> read_grid(const std::vector<std::string>& words) {
  std::vector<GridAxis> axes;
  axes.reserve(words.size());
  for (const std::string& word : words) axes.push_back(read_axis(word));
  return axes;
}

std::vector<BatchJob> expanded(const std::vector<BatchJob>& jobs,
                               const std::vector<GridAxis>& axes) {
  std::vector<BatchJob> all = jobs;
  for (const GridAxis& axis : axes) {
    std::vector<BatchJob> next;
    for (const BatchJob& job : all) {
      for (const std::string& value : axis.values) next.push_back(with(job, axis, value));
    }
    all = std::move(next);
  }
  require_different_names(all, "--grid");
  return all;
}

namespace {

namespace fs = std::filesystem;

using Status = JobOutcome::Status;

constexpr const char* kWork = ".work";
constexpr const char* kLens = "out";  ///< In a job's work folder: what gets its name.
constexpr const char* kOld = "old";   ///< The replaced folder.
constexpr const char* kStepOutput = "step.json";
constexpr const char* kJobFormat = "lensforge.job";

/// A command that was interrupted with its batch ends within a second and then lets go of the
/// folder.
constexpr int kAttempts = 100;
constexpr std::chrono::milliseconds kBetweenAttempts{50};

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// job.json in the job's folder or in that of its work; null if there is none.
Json record_in(const fs::path& folder) {
  Json record = json_in(folder / kJobFile);
  return record.is_object() && record.value("format", "") == kJobFormat ? record : Json();
}

bool is_of(const Json& record, const BatchJob& job) {
  return record.is_object() && record.value("job", Json()) == job.json();
}

JobOutcome outcome_of(const Json& record, bool earlier) {
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
    const Json done = record_in(place_.out / job_.name);
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
    record_ = {{"format", kJobFormat},      {"version", 1},
               {"job", job_.json()},        {"steps", Json::array()},
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
    for (const Json& step : record_["steps"]) {
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
  Json record_;
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

Json job_record(const BatchJob& job, const fs::path& out) {
  for (const fs::path& folder : {out / job.name, out / kWork / job.name}) {
    Json record = record_in(folder);
    if (is_of(record, job)) return record;
  }
  return {};
}

void require_room_for_job(const BatchJob& job, const BatchPlace& place) {
  const fs::path folder = place.out / job.name;
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) return;
  const Json record = record_in(folder);
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

std::string cell_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// Every value within objects; lists are no single values and are left out.
void add_values(const std::string& prefix, const Json& value, Table& table, Table::Cells& row) {
  if (value.is_object()) {
    for (const auto& [key, inner] : value.items()) {
      const bool repeats = key == "options" || key == "command" || key == "out";
      if (!repeats) add_values(std::string(prefix).append(".").append(key), inner, table, row);
    }
  } else if (!value.is_array() && !value.is_null()) {
    table.add(row, prefix, cell_of(value));
  }
}

void add_options(const Json& steps, Table& table, Table::Cells& row) {
  for (const Json& step : steps) {
    for (const auto& [key, value] : step["options"].items()) {
      table.add(row, step["command"].get<std::string>() + "." + key, cell_of(value));
    }
  }
}

void add_results(const Json& steps, Table& table, Table::Cells& row) {
  for (const Json& step : steps) add_values(step["command"], step["result"], table, row);
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
