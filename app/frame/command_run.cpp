// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/command_run.h"

#include <unistd.h>

#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/frame/interrupt.h"
#include "core/error.h"
#include "core/io/files.h"

namespace lensforge::app {

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> missing_above(const fs::path& path) {
  std::vector<fs::path> missing;
  std::error_code ignored;
  fs::path above = fs::absolute(path, ignored).lexically_normal().parent_path();
  for (; !above.empty() && !fs::exists(above, ignored); above = above.parent_path()) {
    missing.push_back(above);
  }
  return missing;
}

}  // namespace

OutputFolder::OutputFolder(fs::path path, FolderLock::Kind kind)
    : path_(std::move(path)),
      missing_(missing_above(path_)),
      folder_(FolderLock::make(path_, kind)) {}

OutputFolder::~OutputFolder() {
  if (!folder_.made || !folder_.lock || !folder_.lock->become_exclusive()) return;
  std::error_code ignored;
  fs::remove(path_, ignored);  // Only succeeds on an empty folder.
  for (const fs::path& above : missing_) fs::remove(above, ignored);
}

void OutputFolder::remove_partial_files(
    const std::function<bool(const std::string& name)>& ours) const {
  std::error_code ignored;
  std::vector<fs::path> partial;
  for (const auto& entry : fs::directory_iterator(path_, ignored)) {
    const std::string name = name_of_partial(entry.path().filename().string());
    if (!name.empty() && ours(name)) partial.push_back(entry.path());
  }
  for (const fs::path& path : partial) fs::remove_all(path, ignored);
}

namespace {

/// Reports that a command was interrupted before it wrote anything. Returns the exit code.
int report_interrupted(bool json) noexcept {
  return report_error("interrupted; nothing was written", kInterrupted, json);
}

}  // namespace

/// Work that was begun. An interrupt ends the process if `abandoned`.
struct CommandFrame::Work {
  Work(bool prints_json, std::unique_ptr<OutputFolder> out, bool abandoned)
      : json(prints_json), stops_executors(abandoned), folder(std::move(out)) {}

  /// Shows progress on the terminal and takes its interrupts.
  void face_terminal(bool quiet) {
    progress.emplace(quiet);
    watch.emplace(SecondInterrupt::kExit,
                  stops_executors ? [this] { abandon(); } : std::function<void()>());
  }

  void begin_writing() {
    const std::lock_guard lock(mutex);
    writing = true;
  }

  void abandon() {
    const std::lock_guard lock(mutex);
    if (writing) return;
    folder.reset();
    progress->wipe();
    _exit(report_interrupted(json));
  }

  bool json;
  bool stops_executors;
  std::unique_ptr<OutputFolder> folder;
  std::optional<ProgressDisplay> progress;
  std::function<void()> accepted;
  std::once_flag accepted_once;
  std::mutex mutex;
  bool writing = false;
  std::optional<InterruptWatch> watch;  ///< Last, so that it ends first.
};

CommandFrame::CommandFrame(OptionSet& options)
    : options_(options), console_(options.common().json, options.common().quiet) {}

CommandFrame::CommandFrame(OptionSet& options, RunControl host)
    : options_(options), console_(false, true), host_(std::move(host)) {}

CommandFrame::~CommandFrame() = default;

void CommandFrame::start(std::unique_ptr<OutputFolder> folder, bool abandoned, bool quiet) {
  work_ = std::make_unique<Work>(options_.common().json, std::move(folder), abandoned);
  if (!host_) work_->face_terminal(quiet);
}

void CommandFrame::begin() {
  work_.reset();  // There is one watch for interrupts at a time.
  start(nullptr, false, true);
}

void CommandFrame::begin_file(const fs::path& out) {
  work_.reset();
  auto folder = out.empty() ? nullptr
                            : std::make_unique<OutputFolder>(fs::absolute(out).parent_path(),
                                                             FolderLock::Kind::kShared);
  start(std::move(folder), true, options_.common().quiet);
}

void CommandFrame::begin_writing() { work_->begin_writing(); }

const OutputFolder& CommandFrame::begin_folder(const fs::path& out) {
  work_.reset();
  auto folder = std::make_unique<OutputFolder>(out, FolderLock::Kind::kExclusive);
  start(std::move(folder), false, options_.common().quiet);
  return *work_->folder;
}

RunControl CommandFrame::control(std::function<void()> accepted) {
  RunControl shown = host_ ? *host_ : RunControl(work_->watch->token(), work_->progress->sink());
  if (!accepted) return shown;
  work_->accepted = std::move(accepted);
  return {shown.stop_token(), [this, shown](const Progress& progress) {
            if (progress.done > 0.0) accept();
            shown.report(progress);
          }};
}

void CommandFrame::accept() {
  std::call_once(work_->accepted_once, [this] {
    if (work_->progress) work_->progress->wipe();
    work_->accepted();
  });
}

std::stop_token CommandFrame::stop_token() const {
  return host_ ? host_->stop_token() : work_->watch->token();
}

void CommandFrame::report_to_host(const Progress& progress) const {
  if (host_) host_->report(progress);
}

Executor CommandFrame::stoppable(const Executor& executor) const {
  return work_ && work_->stops_executors ? executor.with_stop(stop_token()) : executor;
}

ChosenDevice CommandFrame::device_executor() const {
  const ChosenDevice device = options_.device_executor();
  return {stoppable(device.executor), device.word};
}

int CommandFrame::print(CommandResult result, const std::string& command) {
  if (work_) {
    work_->begin_writing();  // It is no longer abandoned.
    work_->progress.reset();
  }
  for (const std::string& warning : result.warnings) console_.note("warning: " + warning);
  if (!result.json.is_null()) {
    result.json["command"] = command;
    console_.result(result.json, result.text);
  }
  for (const std::string& note : result.notes) console_.note(note);
  return result.exit_code;
}

int run_framed(const std::string& command, OptionSet& options, const Arguments& arguments,
               const std::function<CommandResult(CommandFrame&)>& work) {
  options.parse(arguments);
  try {
    CommandFrame frame(options);
    return frame.print(work(frame), command);
  } catch (const Interrupted&) {
    return report_interrupted(options.common().json);
  }
}

void announce_work(const WorkEstimate& needed, const Console& console, const std::string& what) {
  if (!(needed.seconds > kWorthTelling)) return;
  console.note(what + " " + estimate_words(needed));
  console.begin();
}

}  // namespace lensforge::app
