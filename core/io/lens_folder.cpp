// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/lens_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr std::streamoff kSearched = 4096;
constexpr std::string_view kMark = "lensforge ";

/// "lensforge " and a digit of the version.
bool has_mark(std::string_view bytes) {
  for (std::size_t at = bytes.find(kMark); at != std::string_view::npos;
       at = bytes.find(kMark, at + 1)) {
    const std::size_t digit = at + kMark.size();
    if (digit < bytes.size() && std::isdigit(static_cast<unsigned char>(bytes[digit])) != 0) {
      return true;
    }
  }
  return false;
}

std::string bytes_from(std::ifstream& file, std::streamoff offset) {
  std::string bytes(kSearched, '\0');
  file.clear();
  file.seekg(offset);
  file.read(bytes.data(), kSearched);
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
  return bytes;
}

bool is_one_of(const fs::path& name, const auto& names) {
  return std::find(names.begin(), names.end(), name.string()) != names.end();
}

/// The folder of a file, also if its path names none.
fs::path folder_of(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(path, error);
  return (error ? fs::absolute(path) : whole).parent_path();
}

bool holds_lens(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / lens_file::kJson, ignored) ||
         fs::exists(folder / lens_file::kCheckpoint, ignored);
}

}  // namespace

bool written_by_lensforge(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  const auto size = static_cast<std::streamoff>(fs::file_size(path, error));
  std::ifstream file(path, std::ios::binary);
  if (error || !file) return false;
  return has_mark(bytes_from(file, 0)) ||
         has_mark(bytes_from(file, std::max<std::streamoff>(0, size - kSearched)));
}

bool belongs_to_lens(const fs::path& path) {
  const fs::path folder = folder_of(path);
  if (is_one_of(path.filename(), lens_file::kAll) && holds_lens(folder)) return true;
  const fs::path name = path.filename();
  const bool cut =
      folder.filename() == lens_file::kCut || folder.filename() == lens_file::kFrontCut;
  return cut && (is_one_of(name, lens_file::kCutFiles) || is_one_of(name, lens_file::kCutLayers)) &&
         holds_lens(folder.parent_path());
}

void require_replaceable(const std::string& option, const fs::path& path, bool force) {
  const std::string what = option + " " + path.string() + ": ";
  if (path.filename().empty()) throw InputError(what + "names no file");
  if (belongs_to_lens(path)) {
    throw InputError(what + "is a part of the lens folder; choose another name");
  }
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return;
  if (status.type() == fs::file_type::none) throw InputError(what + error.message());
  if (!fs::is_regular_file(status)) {
    throw InputError(what + "is no regular file and is not replaced; choose another name");
  }
  if (force || fs::file_size(path, error) == 0 || written_by_lensforge(path)) return;
  throw InputError(what +
                   "is there already and lensforge did not write it; choose another name or "
                   "replace it with --force");
}

namespace {

/// Attempts, and time between them, while another command removes an empty folder.
constexpr int kAttempts = 50;
constexpr std::chrono::milliseconds kBetweenAttempts{2};

[[noreturn]] void refuse_held(const fs::path& folder) {
  throw FolderHeld(folder.string() + ": another lensforge command is working in this folder; " +
                   "wait for its end or choose another folder");
}

}  // namespace

FolderLock::FolderLock(const fs::path& folder, Kind kind) {
  open(folder);
  if (!folder_.open()) {
    const int error = errno;
    const std::string message = folder.string() + ": cannot be opened: " + system_reason(error);
    if (error == ENOENT) throw MissingFile(message, folder.string());
    throw InputError(message);
  }
  if (!attempt(kind)) refuse_held(folder);
}

MadeFolder FolderLock::make(const fs::path& folder, Kind kind) {
  MadeFolder result;
  for (int i = 0; i < kAttempts && !result.lock; ++i) {
    if (i > 0) std::this_thread::sleep_for(kBetweenAttempts);
    std::error_code ignored;
    result.made = result.made || !fs::exists(folder, ignored);
    fs::create_directories(folder, ignored);
    FolderLock lock;
    lock.open(folder);
    // The locked folder may have been removed just before.
    const bool held = lock.folder_.open() && lock.attempt(kind) && lock.is_at(folder);
    if (held) result.lock = std::move(lock);
  }
  require_writable_folder(folder);
  // Throws the reason.
  if (!result.lock && kind == Kind::kExclusive) result.lock = FolderLock(folder, kind);
  return result;
}

bool FolderLock::become_exclusive() { return attempt(Kind::kExclusive); }

void FolderLock::open(const fs::path& folder) {
  folder_ = Descriptor(::open(folder.empty() ? "." : folder.c_str(),
                              O_RDONLY | O_DIRECTORY | O_NONBLOCK | O_CLOEXEC));
}

bool FolderLock::attempt(Kind kind) {
  const int operation = kind == Kind::kExclusive ? LOCK_EX : LOCK_SH;
  int result = 0;
  do {
    result = ::flock(folder_.number(), operation | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  // A file system without locks is accepted.
  return result == 0 || errno != EWOULDBLOCK;
}

bool FolderLock::is_at(const fs::path& folder) const {
  struct stat locked {};
  struct stat there {};
  return ::fstat(folder_.number(), &locked) == 0 &&
         ::stat(folder.empty() ? "." : folder.c_str(), &there) == 0 &&
         locked.st_dev == there.st_dev && locked.st_ino == there.st_ino;
}

}  // namespace lensforge
