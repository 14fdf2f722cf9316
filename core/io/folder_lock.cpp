// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "core/error.h"

namespace lensforge {

FolderLock::FolderLock(const std::filesystem::path& folder, Kind kind)
    : descriptor_(::open(folder.empty() ? "." : folder.c_str(),
                         O_RDONLY | O_DIRECTORY | O_NONBLOCK | O_CLOEXEC)) {
  if (descriptor_ < 0) {
    throw InputError(folder.string() +
                     ": cannot be opened: " + std::generic_category().message(errno));
  }
  const int operation = kind == Kind::kExclusive ? LOCK_EX : LOCK_SH;
  int error = 0;
  while (::flock(descriptor_, operation | LOCK_NB) != 0) {
    error = errno;
    if (error != EINTR) break;
    error = 0;
  }
  // A file system that has no locks is no reason not to work there.
  if (error != EWOULDBLOCK) return;
  ::close(descriptor_);
  throw InputError(folder.string() + ": another lensforge command is working in this folder; " +
                   "wait for its end or choose another folder");
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

}  // namespace lensforge
