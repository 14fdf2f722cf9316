// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "core/io/descriptor.h"

namespace lensforge {

/// Keeps other lensforge commands out of a folder while it lives: an advisory lock (flock) on the
/// folder itself, so that no file stands for it. The system drops it with the process, however that
/// ends.
class FolderLock {
 public:
  enum class Kind {
    kExclusive,  ///< Nobody else: this command writes here.
    kShared,     ///< No writer: this command reads what must stay as it is.
  };

  /// @throw InputError if `folder` cannot be opened, or another process holds it.
  FolderLock(const std::filesystem::path& folder, Kind kind);

 private:
  Descriptor folder_;
};

}  // namespace lensforge
