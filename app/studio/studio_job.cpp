// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/studio/studio_job.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "app/commands/design_command.h"
#include "app/frame/child_command.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "core/error.h"
#include "design/design.h"
#include "design/schedule/levels.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Between looks at a running design's checkpoint.
constexpr std::chrono::milliseconds kLook{300};
/// The end of a log that is read for its last line.
constexpr std::streamoff kTail = 4096;

/// Last line of a log, without the program's name.
std::string last_line_of(const fs::path& log) {
  std::ifstream stream(log, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream ? static_cast<std::streamoff>(stream.tellg()) : 0;
  stream.seekg(std::max<std::streamoff>(0, size - kTail));
  return last_line(std::string(std::istreambuf_iterator<char>(stream), {}));
}

/// The share in "design, level 2 of 2  57 %  MAE 0.0012": the number before the first " %".
std::optional<double> share_in(const std::string& line) {
  const std::size_t percent = line.find(" %");
  if (percent == std::string::npos || percent == 0) return std::nullopt;
  const std::size_t begin = line.find_last_not_of("0123456789", percent - 1) + 1;
  if (begin == percent) return std::nullopt;
  return std::clamp(std::stod(line.substr(begin, percent - begin)) / 100.0, 0.0, 1.0);
}

/// What a design is for, by its command line. @throw InputError.
DesignGoalView goal_of(const Arguments& words) {
  DesignSettings settings;
  OptionSet options("design", "");
  options.fields(settings);
  options.parse({words.begin() + 1, words.end()});
  const LoadedImage loaded = read_target(settings, {});
  settle(options, settings, loaded.image, {});
  Image target = working_picture(loaded.image, settings.design, {});
  const OpticalSetup setup = optical_setup(settings.design, {target.columns(), target.rows()});
  DesignGoalView goal{std::move(target), setup, settings.design.model};
  if (const auto& second = settings.design.second.picture) {
    goal.second = working_picture(*second, settings.design, {});
  }
  return goal;
}

/// The words with paths that are valid in this process, which works in another folder.
Arguments absolute_words(const fs::path& folder, Arguments words) {
  for (std::size_t i = 1; i < words.size(); ++i) {
    const bool path = !words[i].starts_with("--") && fs::exists(folder / words[i]);
    const bool out = words[i - 1] == "--out";
    if (path || out) words[i] = (folder / words[i]).string();
  }
  return words;
}

std::string end_word(int exit_code, bool stopped) {
  if (exit_code == kDone || exit_code == kLimitMissed) return "done";
  if (exit_code == kInterrupted || stopped) return "paused";
  return "failed";
}

}  // namespace

std::string command_text(const Arguments& words) {
  std::string text = "lensforge";
  for (const std::string& word : words) text.append(" ").append(shell_word(word));
  return text;
}

bool ComputeTurn::take(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (!free_.wait(lock, stop, [this] { return !taken_; })) return false;
  taken_ = true;
  return true;
}

void ComputeTurn::give_back() {
  {
    const std::lock_guard lock(mutex_);
    taken_ = false;
  }
  free_.notify_one();
}

StudioJob::StudioJob(const fs::path& folder, StudioTask task, ComputeTurn* turn)
    : folder_(folder), task_(std::move(task)), turn_(turn) {
  if (task_.step == "send") {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw RunError("pipe: " + system_reason(errno));
    input_ = Descriptor(ends[0]);
    keys_ = Descriptor(ends[1]);
  }
  fs::remove(folder_ / (task_.files + ".log"));
  set(turn_ != nullptr ? "waiting" : "running", "");
  // The runner stops the watcher at its end.
  if (!task_.checkpoint.empty()) {
    watcher_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
  }
  runner_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

StudioJob::~StudioJob() {
  watcher_.request_stop();
  runner_.request_stop();
}

bool StudioJob::running() const {
  const std::lock_guard lock(mutex_);
  return status_ == "waiting" || status_ == "running" || status_ == "stopping";
}

void StudioJob::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (status_ == "running") status_ = "stopping";
  }
  runner_.request_stop();
}

void StudioJob::press(char key) const {
  // A pipe that is full belongs to a sender that takes no keys any more.
  if (keys_.open()) (void)!::write(keys_.number(), &key, 1);
}

void StudioJob::run(const std::stop_token& stop) {
  if (turn_ != nullptr && !turn_->take(stop)) return set("paused", "");
  set("running", "");
  int code = kFailed;
  std::string message;
  const fs::path log = folder_ / (task_.files + ".log");
  try {
    Arguments words = task_.words;
    words.emplace_back("--json");
    if (turn_ != nullptr) {
      words.insert(words.end(), turn_->common().begin(), turn_->common().end());
    }
    code = run_child({{}, words, folder_ / (task_.files + ".out"), log, folder_, input_.number()},
                     stop)
               .exit_code;
    message = code == kDone ? "" : last_line_of(log);
  } catch (const std::exception& e) {
    message = e.what();
  }
  if (turn_ != nullptr) turn_->give_back();
  watcher_.request_stop();
  set(end_word(code, stop.stop_requested()), message);
}

void StudioJob::set(const std::string& status, const std::string& message) {
  {
    const std::lock_guard lock(mutex_);
    status_ = status;
    message_ = message;
  }
  try {
    write_whole_file(
        folder_ / (task_.files + ".json"),
        json{{"step", task_.step}, {"words", task_.words}, {"status", status}, {"message", message}}
            .dump(2));
  } catch (const RunError&) {
    // A full disk: the job's own messages say so.
  }
}

void StudioJob::watch(const std::stop_token& stop) {
  const Executor executor = Executor::cpu(1).with_stop(stop);
  std::optional<DesignGoalView> goal;
  fs::file_time_type seen = fs::file_time_type::min();
  for (std::int64_t number = 1; !stop.stop_requested();) {
    {
      std::unique_lock lock(mutex_);
      ended_.wait_for(lock, stop, kLook, [] { return false; });
    }
    std::error_code none;
    const fs::file_time_type saved = fs::last_write_time(task_.checkpoint, none);
    if (none || saved == seen) continue;
    seen = saved;
    try {
      if (!goal) goal = goal_of(absolute_words(folder_, task_.words));
      LiveState state = state_of_design(task_.checkpoint, *goal, number, executor);
      const std::lock_guard lock(mutex_);
      live_ = std::move(state);
      ++number;
    } catch (const std::exception&) {
      // The design itself reports a bad checkpoint and ends if it cannot continue.
    }
  }
}

json StudioJob::state() const {
  const std::lock_guard lock(mutex_);
  const bool runs = status_ == "running" || status_ == "stopping";
  const std::string words = runs ? last_line_of(folder_ / (task_.files + ".log")) : "";
  const std::optional<double> share = share_in(words);
  json state{{"step", task_.step},
             {"status", status_},
             {"command", command_text(task_.words)},
             {"share", share ? json(*share) : json()},
             {"words", words},
             {"message", message_},
             {"live", nullptr}};
  if (live_.number > 0) {
    state["live"] = json::parse(live_.json);
    state["live"]["two_screens"] = !live_.second.empty();
  }
  return state;
}

std::string StudioJob::live_picture(std::string LiveState::*picture) const {
  const std::lock_guard lock(mutex_);
  return live_.*picture;
}

json earlier_job(const fs::path& folder, const std::string& files) {
  const json record = json_in(folder / (files + ".json"));
  if (!record.is_object() || !record.contains("words")) return nullptr;
  const std::string status = record.value("status", "");
  const bool ended = status == "done" || status == "failed" || status == "paused";
  return {{"step", record.value("step", "")},
          {"status", ended ? status : "interrupted"},
          {"command", command_text(record["words"].get<Arguments>())},
          {"share", nullptr},
          {"words", ""},
          {"message", record.value("message", "")},
          {"live", nullptr}};
}

}  // namespace lensforge::app
