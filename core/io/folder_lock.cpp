// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "core/io/files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

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
    throw InputError(folder.string() +
                     ": cannot be opened: " + std::generic_category().message(errno));
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
