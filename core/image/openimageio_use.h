// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <shared_mutex>

namespace lensforge {

/// Guard for calls of OpenImageIO: while one exists, no other thread forks. A process forked while
/// a thread is inside the library would wait forever for the library's locks. Hold it briefly. It
/// keeps OpenImageIO and OpenEXR from starting threads, since a forked process would lack them.
class OpenImageIoUse {
 public:
  OpenImageIoUse();

 private:
  std::shared_lock<std::shared_mutex> lock_;
};

}  // namespace lensforge
