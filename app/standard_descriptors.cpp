// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/standard_descriptors.h"

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace lensforge::app {
namespace {

/// Opened for what it is not used for, so that a result that cannot be printed stays an error.
long open_placeholder(const char* path, int number) {
  const int mode = number == STDIN_FILENO ? O_WRONLY : O_RDONLY;
  return ::syscall(SYS_openat, AT_FDCWD, path, mode, 0);
}

}  // namespace

// System calls without their wrappers: it runs before any library, a sanitizer's included, is set
// up. The lowest free number is the one that is closed, as those below it are open by then.
__attribute__((no_sanitize("address", "undefined"))) void hold_standard_descriptors() noexcept {
  for (int number = STDIN_FILENO; number <= STDERR_FILENO; ++number) {
    if (::syscall(SYS_fcntl, number, F_GETFD) >= 0) continue;
    if (open_placeholder("/dev/null", number) == number) continue;
    // Without /dev the root folder serves: it cannot be written either.
    if (::syscall(SYS_openat, AT_FDCWD, "/", O_RDONLY | O_DIRECTORY, 0) != number) ::_exit(1);
  }
}

}  // namespace lensforge::app
