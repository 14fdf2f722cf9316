// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>

#include "app/frame/console.h"
#include "app/frame/interrupt.h"
#include "app/frame/option_set.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/compute/work_estimate.h"
#include "core/io/folder_lock.h"
#include "core/text/lower_case.h"

/// What a command works with: files known by their names, the folder that it writes, and a job that
/// an interrupt ends.
namespace lensforge::app {

/// Whether a file's name ends so, in capitals or not. @param extensions  as ".ply".
inline bool has_extension(const std::filesystem::path& path,
                          std::initializer_list<const char*> extensions) {
  const std::string own = lower_case(path.extension().string());
  return std::find(extensions.begin(), extensions.end(), own) != extensions.end();
}

inline bool is_step_file(const std::filesystem::path& path) {
  return has_extension(path, {".step", ".stp"});
}

/// A folder that a command writes into: made if it is not there, locked, and taken away again if
/// nothing was put into it and nobody else is at work in it.
class OutputFolder {
 public:
  /// @param kind  exclusive for what fills the folder; shared for a file among others', which is
  ///              also let in where another command fills it.
  /// @throw InputError if files cannot be made in `path`; for an exclusive one also if another
  ///        command is working there.
  OutputFolder(std::filesystem::path path, FolderLock::Kind kind);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Removes what a process that was killed here was about to write under names that are `ours`.
  /// @pre the folder is exclusive: what a live process is writing must not go.
  void remove_partial_files(const std::function<bool(const std::string& name)>& ours) const;

 private:
  std::filesystem::path path_;
  MadeFolder folder_;
};

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
