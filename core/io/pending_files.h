// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/files.h"

namespace lensforge {

/// Files of a folder that are published together: if one of them cannot be written, none appears.
class PendingFiles {
 public:
  /// @param folder  exists, or is made before the first add().
  explicit PendingFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

  /// Lets `write` make a file beside its name (same extension). @throw RunError
  void add(const std::string& name,
           const std::function<void(const std::filesystem::path& beside)>& write);
  /// The same for content that is in memory.
  void add(const std::string& name, std::string_view content);
  [[nodiscard]] bool has(const std::string& name) const;
  /// Renames them to their names in the order of add(). @return their paths.
  /// @throw RunError
  std::vector<std::filesystem::path> publish();

 private:
  std::filesystem::path folder_;
  std::vector<PendingFile> files_;
};

}  // namespace lensforge
