// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace lensforge::app {

/// A folder that a command writes into: made if it is not there, and taken away again if nothing
/// was put into it.
class OutputFolder {
 public:
  /// @throw InputError if files cannot be made in `path`.
  explicit OutputFolder(std::filesystem::path path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Removes what a process that was killed here was about to write under names that are `ours`.
  /// @pre the folder is locked (FolderLock): what a live process is writing must not go.
  void remove_partial_files(const std::function<bool(const std::string& name)>& ours) const;

 private:
  std::filesystem::path path_;
  bool existed_;
};

}  // namespace lensforge::app
