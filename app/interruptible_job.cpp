// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/interruptible_job.h"

#include <unistd.h>

#include "app/exit_code.h"

namespace lensforge::app {

namespace fs = std::filesystem;

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
