// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "core/error.h"
#include "core/io/descriptor.h"

namespace lensforge {

struct MadeFolder;

/// Another process holds the folder.
class FolderHeld : public InputError {
 public:
  using InputError::InputError;
};

/// Keeps other lensforge commands out of a folder while it lives: an advisory lock (flock) on the
/// folder itself, without a lock file. The system releases it when the process ends in any way.
class FolderLock {
 public:
  enum class Kind {
    kExclusive,  ///< No other command: this one writes here.
    kShared,     ///< No writer: this command reads files that must not change.
  };

  /// @throw InputError if `folder` cannot be opened; FolderHeld if another process holds it.
  FolderLock(const std::filesystem::path& folder, Kind kind);

  /// Makes `folder` (and its parents) if needed, and locks it before another command can remove it.
  /// Waits at most 0.1 s for other commands. If one still holds the folder in any way, an exclusive
  /// lock fails; if it holds it exclusively, a shared lock is left out (MadeFolder::lock).
  /// @throw InputError if the folder or files in it cannot be made; FolderHeld if another process
  ///        holds it, for an exclusive lock.
  static MadeFolder make(const std::filesystem::path& folder, Kind kind);

  /// Returns true if nobody else holds the folder; from then on nobody else can. If it returns
  /// false, a shared lock may be lost: the system releases it before it tries (flock(2)).
  bool become_exclusive();

 private:
  FolderLock() = default;

  void open(const std::filesystem::path& folder);
  bool attempt(Kind kind);
  [[nodiscard]] bool is_at(const std::filesystem::path& folder) const;

  Descriptor folder_;
};

/// A folder that FolderLock::make() has made or found.
struct MadeFolder {
  std::optional<FolderLock> lock;  ///< None if a shared lock could not be taken.
  bool made = false;               ///< False if it existed.
};

}  // namespace lensforge
