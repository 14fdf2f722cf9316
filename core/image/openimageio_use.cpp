// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/openimageio_use.h"

#include <OpenImageIO/imageio.h>
#include <pthread.h>

#include <memory>

namespace lensforge {
namespace {

/// A process has one OpenImageIO, so the gate is global.
std::shared_mutex& gate() {
  static std::shared_mutex only;
  return only;
}

/// The forked thread's id differs from the one that locked the gate, so it cannot unlock it.
void open_gate_of_copy() { std::construct_at(&gate()); }

bool set_up() {
  ::pthread_atfork([] { gate().lock(); }, [] { gate().unlock(); }, open_gate_of_copy);
  OIIO::attribute("threads", 1);
  OIIO::attribute("exr_threads", -1);  // Only the caller's thread.
  return true;
}

std::shared_lock<std::shared_mutex> locked() {
  static const bool ready = set_up();
  static_cast<void>(ready);
  return std::shared_lock(gate());
}

}  // namespace

OpenImageIoUse::OpenImageIoUse() : lock_(locked()) {}

}  // namespace lensforge
