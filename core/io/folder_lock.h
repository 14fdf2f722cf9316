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

  /// Makes `folder` (and its parents) if need be, and locks it before anybody takes it away again.
  /// @param made  whether it was not there.
  /// @throw InputError if the folder cannot be made or files cannot be made in it; if another
  ///        process holds it, for an exclusive lock. A shared one is then not held.
  static FolderLock make(const std::filesystem::path& folder, Kind kind, bool& made);

  /// Whether nobody else holds the folder; from here on nobody else can.
  bool become_exclusive();

 private:
  FolderLock() = default;

  void open(const std::filesystem::path& folder);
  bool attempt(Kind kind);
  [[nodiscard]] bool is_at(const std::filesystem::path& folder) const;

  Descriptor folder_;
};

}  // namespace lensforge
