// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <shared_mutex>

namespace lensforge {

/// While one lives, this thread calls OpenImageIO, and no other thread forks: the copy of a process
/// whose thread is inside of the library would wait forever for the locks that it holds. Hold it
/// for moments. OpenImageIO and OpenEXR start no threads of their own, for a forked process has
/// none of them.
class OpenImageIoUse {
 public:
  OpenImageIoUse();

 private:
  std::shared_lock<std::shared_mutex> lock_;
};

}  // namespace lensforge
