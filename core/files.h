// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace lensforge {

/// A file in the making: it is written beside `path` (same folder, same extension) and appears
/// under its name, whole, with publish(); without that nothing is left behind.
class PendingFile {
 public:
  /// Makes the empty file beside. @throw RunError naming the file and the system's reason.
  explicit PendingFile(std::filesystem::path path);
  ~PendingFile();
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Where to write.
  [[nodiscard]] const std::filesystem::path& beside() const { return beside_; }
  /// Flushes it to disk and renames it to path(). @throw RunError naming the file and the reason.
  void publish();
  /// publish() under another name. @pre in the same folder.
  void publish_as(std::filesystem::path path);

 private:
  std::filesystem::path path_;
  std::filesystem::path beside_;  ///< Empty once it is published.
};

/// Lets `write` make a file beside `path` (same extension), flushes it to disk and renames it to
/// `path`: the file appears whole or not at all, and nothing is left behind if `write` throws.
/// @throw RunError naming the file and the system's reason.
void write_whole_file(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& beside)>& write);

/// write_whole_file() for content that is already in memory.
void write_whole_file(const std::filesystem::path& path, std::string_view content);

/// Makes `folder` (and its parents) if need be and proves that files can be made in it.
/// @throw InputError naming the folder and the system's reason.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace lensforge
