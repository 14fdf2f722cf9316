// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/stderr_silence.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <mutex>

namespace lensforge {
namespace {

/// There is one standard error in a process, so what is known of it is known once.
struct Redirection {
  std::mutex mutex;
  int count = 0;
  int saved = -1;
};

Redirection& redirection() {
  static Redirection only;
  return only;
}

}  // namespace

StderrSilence::StderrSilence() {
  Redirection& r = redirection();
  const std::lock_guard lock(r.mutex);
  if (r.count++ > 0) return;
  std::fflush(stderr);
  r.saved = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (r.saved >= 0 && nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
  if (nowhere >= 0) ::close(nowhere);
}

StderrSilence::~StderrSilence() {
  Redirection& r = redirection();
  const std::lock_guard lock(r.mutex);
  if (--r.count > 0 || r.saved < 0) return;
  std::fflush(stderr);
  ::dup2(r.saved, STDERR_FILENO);
  ::close(r.saved);
  r.saved = -1;
}

}  // namespace lensforge
