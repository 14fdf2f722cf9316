// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/descriptor.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace lensforge {

int Descriptor::above_standard(int number) {
  if (number < 0 || number > STDERR_FILENO) return number;
  const int moved = ::fcntl(number, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int error = errno;
  ::close(number);
  errno = error;
  return moved;
}

int Descriptor::close() {
  const int number = std::exchange(number_, -1);
  return number >= 0 && ::close(number) != 0 ? errno : 0;
}

}  // namespace lensforge
