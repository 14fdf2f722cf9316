// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "core/io/folder_lock.h"

namespace lensforge::app {

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
  bool made_ = false;
  FolderLock lock_;
};

}  // namespace lensforge::app
