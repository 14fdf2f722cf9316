// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/batch_job.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

#include "app/frame/option_set.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/json.h"
#include "core/schema/option_text.h"
#include "core/text/number_text.h"

namespace lensforge::app {
namespace {

using nlohmann::json;

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

std::string word_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// @throw InputError unless the option can have this value.
void require_value(const FieldSpec& spec, const json& value) {
  const auto is_word = [](const json& v) { return v.is_string() || v.is_number(); };
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
  JobLine(const json& line, const std::string& where) : fields_(line, where), where_(where) {
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

  static json options_of(const JsonFields& fields) {
    if (!fields.has("options")) return json::object();
    const json& options = fields.at("options");
    if (!options.is_object()) fields.refuse("options", "an object of option names and values");
    return options;
  }

  void add_further(const json& then, BatchJob& job) const {
    if (!then.is_array()) fields_.refuse("then", "a list of commands");
    if (!then.empty() && job.steps.front().command != "design") {
      refuse("then", "only a design can be followed by other commands");
    }
    for (const json& next : then) {
      if (next.is_string()) {
        job.steps.push_back(step(next.get<std::string>(), json::object(), false));
      } else {
        const JsonFields fields(next, where_, "then.");
        job.steps.push_back(step(fields.text("command"), options_of(fields), false));
      }
    }
  }

  [[nodiscard]] BatchStep step(const std::string& name, const json& options, bool first) const {
    const JobCommand* command = command_named(name);
    if (command == nullptr || command->first != first) {
      refuse("command " + json(name).dump(),
             first ? "design or reflect" : "cam, export or render after a design");
    }
    BatchStep step{name, json::object()};
    for (const auto& [key, value] : options.items()) set(step, key, value);
    return step;
  }

  void set(BatchStep& step, const std::string& key, const json& value) const {
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

void BatchStep::set(const std::string& name, const json& value) {
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
    if (value == json(false)) continue;
    words.push_back("--" + key);
    if (value.is_boolean()) continue;
    if (!value.is_array()) {
      words.push_back(word_of(value));
      continue;
    }
    for (const json& part : value) words.push_back(word_of(part));
  }
  return words;
}

json BatchJob::json() const {
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
    const json parsed = parse_json(line, where);
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

}  // namespace lensforge::app
