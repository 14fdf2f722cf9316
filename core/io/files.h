// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

/// An open file, device or socket that closes itself. It is never standard input, output or error:
/// text that a library prints there must not reach a controller, a journal, a result or a log.
class Descriptor {
 public:
  /// Takes ownership of `number`; 0 to 2 are moved up first (open() is false if no number is free).
  explicit Descriptor(int number = -1) : number_(above_standard(number)) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool open() const { return number_ >= 0; }
  /// Closes it now, if it is open. Returns 0 or an errno value; some file systems report a full
  /// disk only here.
  int close();

 private:
  static int above_standard(int number);

  int number_;
};

/// Writes all bytes; a signal does not interrupt it. Async-signal-safe. @return false if the system
/// refuses them, with its reason in errno.
bool write_all(int descriptor, std::string_view bytes);

/// The system's words for an errno value.
std::string system_reason(int error);

/// SHA-256 (FIPS 180-4) of bytes added piece by piece.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void update(std::string_view bytes);
  /// 64 lower-case hexadecimal digits for all bytes added. Ends the computation.
  std::string finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// SHA-256 of a file's content. @throw InputError if it cannot be read.
std::string sha256_of(const std::filesystem::path& file);

}  // namespace lensforge
