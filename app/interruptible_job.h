// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "app/console.h"
#include "app/interrupt.h"
#include "app/option_set.h"
#include "app/output_folder.h"
#include "app/progress_display.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/compute/work_estimate.h"

namespace lensforge::app {

/// What a command runs under that writes one file at its end, or none: progress on stderr, and an
/// end within a second of the first interrupt. Work that does not look for it in time (a large
/// system of equations, a library's) is abandoned with the process, unless the file is being
/// written. @throw InputError if `out` has a folder in which files cannot be made.
class InterruptibleJob {
 public:
  explicit InterruptibleJob(const CommonOptions& common, const std::filesystem::path& out = {});

  [[nodiscard]] RunControl control() { return {watch_.token(), progress_.sink()}; }
  /// The same executor, which ends at an interrupt.
  [[nodiscard]] Executor stoppable(const Executor& executor) const {
    return executor.with_stop(watch_.token());
  }

  /// From here on the work is no longer abandoned.
  void begin_writing();

 private:
  void abandon();

  bool json_;
  std::unique_ptr<OutputFolder> folder_;
  ProgressDisplay progress_;
  std::mutex mutex_;
  bool writing_ = false;
  InterruptWatch watch_;  ///< Last, so that it ends first.
};

/// What a command says that was interrupted before it wrote anything. Returns the exit code.
int report_interrupted(bool json) noexcept;

/// Tells about how much a long job takes, at once.
/// @param what  as the subject of a sentence.
void announce_work(const WorkEstimate& needed, const Console& console,
                   const std::string& what = "this takes");

}  // namespace lensforge::app
