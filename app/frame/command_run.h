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
#include "core/compute/work_estimate.h"
#include "core/io/lens_folder.h"
#include "core/text/lower_case.h"

/// Tools of a command: file types by extension, the output folder, and a job that an interrupt
/// ends.
namespace lensforge::app {

/// True if the file has one of these extensions, in any case. @param extensions  with the dot:
/// ".ply".
inline bool has_extension(const std::filesystem::path& path,
                          std::initializer_list<const char*> extensions) {
  const std::string own = lower_case(path.extension().string());
  return std::find(extensions.begin(), extensions.end(), own) != extensions.end();
}

inline bool is_step_file(const std::filesystem::path& path) {
  return has_extension(path, {".step", ".stp"});
}

/// A command's output folder: created if missing, locked, and removed again if it was created but
/// stayed empty and nobody else uses it.
class OutputFolder {
 public:
  /// @param kind  exclusive for a command that fills the folder; shared for one that writes a
  ///        single file, which is allowed even while another command fills the folder.
  /// @throw InputError if files cannot be made in `path`; for an exclusive one also if another
  ///        command is working there.
  OutputFolder(std::filesystem::path path, FolderLock::Kind kind);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Removes partial files that a killed process left for names that are `ours`.
  /// @pre the folder is exclusive: files of a running process must not be removed.
  void remove_partial_files(const std::function<bool(const std::string& name)>& ours) const;

 private:
  std::filesystem::path path_;
  MadeFolder folder_;
};

/// Environment of a command that writes one file at its end, or none: progress on stderr, and an
/// end within a second of the first interrupt. Work that does not check for it in time (a large
/// system of equations, a library call) is abandoned by ending the process, unless the file is
/// being written. @throw InputError if `out` has a folder in which files cannot be made.
class InterruptibleJob {
 public:
  explicit InterruptibleJob(const CommonOptions& common, const std::filesystem::path& out = {});

  [[nodiscard]] RunControl control() { return {watch_.token(), progress_.sink()}; }
  /// The executor, stopped by an interrupt.
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

/// Reports that a command was interrupted before it wrote anything. Returns the exit code.
int report_interrupted(bool json) noexcept;

/// Prints the approximate cost of a long job at once. @param what  the subject of the sentence.
void announce_work(const WorkEstimate& needed, const Console& console,
                   const std::string& what = "this takes");

}  // namespace lensforge::app
