// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/batch_job.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

#include "app/option_set.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/text/json_fields.h"
#include "core/text/json_text.h"
#include "core/text/number_text.h"

namespace lensforge::app {
namespace {

using nlohmann::json;

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{64} << 20U;
constexpr std::size_t kMaxName = 200;

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

/// What batch itself says to a command.
bool is_for_batch(const std::string& option) {
  static const std::set<std::string> reserved{"config", "force", "help",   "json",
                                              "out",    "quiet", "resume", "version"};
  return reserved.contains(option);
}

/// Its options as the manual page lists them, an item ".It Fl -name" each.
const std::string& options_of(const JobCommand& command) {
  static std::map<std::string_view, std::string> texts;
  std::string& text = texts[command.name];
  if (!text.empty()) return text;
  try {
    command.run({"--help-man"});
  } catch (const HelpText& manual) {
    text = "\n" + manual.text;
  }
  return text;
}

std::string word_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
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
    BatchStep step{name, options};
    for (const auto& [key, value] : options.items()) require_option(step, key, value);
    return step;
  }

  void require_option(const BatchStep& step, const std::string& key, const json& value) const {
    const std::string option = "option '" + key + "' of " + step.command;
    if (is_for_batch(key) && !(key == "out" && step.command == "export")) {
      refuse(option, "is set by batch itself");
    }
    if (!step.knows(key)) refuse(option, "no such option; write it without dashes, as in --help");
    const auto is_word = [](const json& v) { return v.is_string() || v.is_number(); };
    const bool words = value.is_array() && std::all_of(value.begin(), value.end(), is_word);
    if (!is_word(value) && !words && value != json(true)) {
      refuse(option + ": " + value.dump(),
             "a text, a number, true, or a list of texts and numbers");
    }
  }

  JsonFields fields_;
  std::string where_;
};

}  // namespace

bool BatchStep::knows(const std::string& name) const {
  if (name == "threads" || name == "device") return true;
  const std::string& list = options_of(*command_named(command));
  const std::string item = "\n.It Fl -" + name;
  return list.find(item + " ") != std::string::npos || list.find(item + "\n") != std::string::npos;
}

Arguments BatchStep::words() const {
  Arguments words;
  for (const auto& [key, value] : options.items()) {
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
  return {{"name", name}, {"target", target}, {"steps", all}};
}

bool is_job_name(const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kMaxName && name[0] != '.' && name[0] != '-' &&
         std::all_of(name.begin(), name.end(), allowed);
}

void require_different_names(const std::vector<BatchJob>& jobs, const std::string& file) {
  std::set<std::string> names;
  for (const BatchJob& job : jobs) {
    if (!names.insert(job.name).second) {
      throw InputError(file + ": name \"" + job.name + "\": two jobs have it, each needs its own");
    }
  }
}

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

}  // namespace lensforge::app
