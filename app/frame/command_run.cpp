// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/command_run.h"

#include <unistd.h>

#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/frame/command_line.h"
#include "core/io/files.h"

namespace lensforge::app {

namespace fs = std::filesystem;

OutputFolder::OutputFolder(fs::path path, FolderLock::Kind kind)
    : path_(std::move(path)), folder_(FolderLock::make(path_, kind)) {}

OutputFolder::~OutputFolder() {
  if (!folder_.made || !folder_.lock || !folder_.lock->become_exclusive()) return;
  std::error_code ignored;
  fs::remove(path_, ignored);  // Only succeeds on an empty folder.
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

std::unique_ptr<OutputFolder> folder_of(const fs::path& out) {
  if (out.empty()) return nullptr;
  return std::make_unique<OutputFolder>(fs::absolute(out).parent_path(), FolderLock::Kind::kShared);
}

}  // namespace

InterruptibleJob::InterruptibleJob(const CommonOptions& common, const fs::path& out)
    : json_(common.json),
      folder_(folder_of(out)),
      progress_(common.quiet),
      watch_(SecondInterrupt::kExit, [this] { abandon(); }) {}

void InterruptibleJob::begin_writing() {
  const std::lock_guard lock(mutex_);
  writing_ = true;
}

void InterruptibleJob::abandon() {
  const std::lock_guard lock(mutex_);
  if (writing_) return;
  folder_.reset();
  progress_.wipe();
  _exit(report_interrupted(json_));
}

int report_interrupted(bool json) noexcept {
  return report_error("interrupted; nothing was written", kInterrupted, json);
}

void announce_work(const WorkEstimate& needed, const Console& console, const std::string& what) {
  if (!(needed.seconds > kWorthTelling)) return;
  console.note(what + " " + estimate_words(needed));
  console.begin();
}

}  // namespace lensforge::app
