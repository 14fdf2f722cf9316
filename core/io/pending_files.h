// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/files.h"

namespace lensforge {

/// Files of a folder that get their names all at once: while one of them cannot be written, none
/// of them appears.
class PendingFiles {
 public:
  /// @param folder  is there, or is made before the first add().
  explicit PendingFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Lets `write` make a file beside its name (same extension). @throw RunError
  void add(const std::string& name,
           const std::function<void(const std::filesystem::path& beside)>& write);
  /// The same for content that is in memory.
  void add(const std::string& name, std::string_view content);
  [[nodiscard]] bool has(const std::string& name) const;
  /// Gives them their names in the order of add(). @return the files by their names.
  /// @throw RunError
  std::vector<std::filesystem::path> publish();

 private:
  std::filesystem::path folder_;
  std::vector<PendingFile> files_;
};

}  // namespace lensforge
