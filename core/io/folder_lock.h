// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "core/error.h"
#include "core/io/descriptor.h"

namespace lensforge {

struct MadeFolder;

/// Another process works in the folder.
class FolderHeld : public InputError {
 public:
  using InputError::InputError;
};

/// Keeps other lensforge commands out of a folder while it lives: an advisory lock (flock) on the
/// folder itself, so that no file stands for it. The system drops it with the process, however that
/// ends.
class FolderLock {
 public:
  enum class Kind {
    kExclusive,  ///< Nobody else: this command writes here.
    kShared,     ///< No writer: this command reads what must stay as it is.
  };

  /// @throw InputError if `folder` cannot be opened; FolderHeld if another process holds it.
  FolderLock(const std::filesystem::path& folder, Kind kind);

  /// Makes `folder` (and its parents) if need be, and locks it before anybody takes it away again.
  /// Waits for a command that comes and goes, 0.1 s at most; one that stays longer, sharing the
  /// folder or not, makes an exclusive lock fail, and an exclusive one leaves others unlocked.
  /// @throw InputError if the folder cannot be made or files cannot be made in it; FolderHeld if
  ///        another process holds it, for an exclusive lock.
  static MadeFolder make(const std::filesystem::path& folder, Kind kind);

  /// Whether nobody else holds the folder; from here on nobody else can. Where it returns false,
  /// a shared lock may be lost: the system lets go of it before it tries (flock(2)).
  bool become_exclusive();

 private:
  FolderLock() = default;

  void open(const std::filesystem::path& folder);
  bool attempt(Kind kind);
  [[nodiscard]] bool is_at(const std::filesystem::path& folder) const;

  Descriptor folder_;
};

/// A folder that FolderLock::make() has made or met.
struct MadeFolder {
  std::optional<FolderLock> lock;  ///< None where a shared one could not be had.
  bool made = false;               ///< It was not there.
};

}  // namespace lensforge
