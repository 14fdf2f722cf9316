// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>

namespace lensforge {

/// An unpublished file: it is written beside `path` (same folder, same extension) and appears whole
/// under its name with publish(); without publish() it is deleted.
class PendingFile {
 public:
  /// Creates the empty temporary file. @throw RunError naming the file and the system's reason.
  explicit PendingFile(std::filesystem::path path);
  ~PendingFile();
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Path to write to.
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

/// Final name of an unpublished file: "lens.stl" for PendingFile's ".lens.partial-7.stl", and for
/// one made beside that; empty for a name of another form.
std::string name_of_partial(std::string_view name);

/// The check of open_input() alone, for libraries that open files by name themselves.
void require_regular_file(const std::filesystem::path& path);

/// Opens a regular file for reading; it refuses named pipes and devices, so it never waits.
/// @throw InputError naming the path and why: missing, no permission, a folder, a named pipe, ...
std::ifstream open_input(const std::filesystem::path& path);

/// All bytes of a regular file. @throw InputError as open_input() does, and if they are more than
/// `max_bytes`.
std::string read_whole_file(const std::filesystem::path& path, std::uintmax_t max_bytes);

/// True if the regular file begins with these bytes. @throw InputError as open_input() does.
bool file_starts_with(const std::filesystem::path& path, std::string_view start);

/// True for a folder; false for a path that cannot be examined, such as a loop of links.
bool is_folder(const std::filesystem::path& path);

/// Makes `folder` (and its parents) if needed and checks that files can be created in it.
/// @throw InputError naming the folder and the system's reason.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace lensforge
