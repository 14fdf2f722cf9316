// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "core/error.h"

namespace lensforge {

FolderLock::FolderLock(const std::filesystem::path& folder, Kind kind)
    : folder_(::open(folder.empty() ? "." : folder.c_str(),
                     O_RDONLY | O_DIRECTORY | O_NONBLOCK | O_CLOEXEC)) {
  if (!folder_.open()) {
    throw InputError(folder.string() +
                     ": cannot be opened: " + std::generic_category().message(errno));
  }
  const int operation = kind == Kind::kExclusive ? LOCK_EX : LOCK_SH;
  int error = 0;
  while (::flock(folder_.number(), operation | LOCK_NB) != 0) {
    error = errno;
    if (error != EINTR) break;
    error = 0;
  }
  // A file system that has no locks is no reason not to work there.
  if (error != EWOULDBLOCK) return;
  throw InputError(folder.string() + ": another lensforge command is working in this folder; " +
                   "wait for its end or choose another folder");
}

}  // namespace lensforge
