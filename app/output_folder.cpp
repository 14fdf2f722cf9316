// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/output_folder.h"

#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/io/files.h"

namespace lensforge::app {

namespace fs = std::filesystem;

OutputFolder::OutputFolder(fs::path path, FolderLock::Kind kind)
    : path_(std::move(path)), lock_(FolderLock::make(path_, kind, made_)) {}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  // Only succeeds on an empty folder.
  if (made_ && lock_.become_exclusive()) fs::remove(path_, ignored);
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

}  // namespace lensforge::app
