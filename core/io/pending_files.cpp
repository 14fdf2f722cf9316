// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/pending_files.h"

#include <algorithm>
#include <utility>

namespace lensforge {

namespace fs = std::filesystem;

void PendingFiles::add(const std::string& name,
                       const std::function<void(const fs::path& beside)>& write) {
  PendingFile file(folder_ / name);
  write(file.beside());
  files_.push_back(std::move(file));
}

void PendingFiles::add(const std::string& name, std::string_view content) {
  add(name, [&](const fs::path& beside) { write_whole_file(beside, content); });
}

bool PendingFiles::has(const std::string& name) const {
  return std::any_of(files_.begin(), files_.end(),
                     [&](const PendingFile& file) { return file.path().filename() == name; });
}

std::vector<fs::path> PendingFiles::publish() {
  std::vector<fs::path> paths;
  for (PendingFile& file : files_) {
    file.publish();
    paths.push_back(file.path());
  }
  return paths;
}

}  // namespace lensforge
