// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <istream>
#include <memory>

#include "core/compute/run_control.h"
#include "machine/stream/job_identity.h"

namespace lensforge {

struct ProgramPieces;

/// A program that is opened and read through once, and from then on gives the bytes of that reading
/// or none: whatever happens to the file meanwhile (another one takes its name, it is written over,
/// cut short or made longer), nothing is checked or sent that does not belong to identity().
///
/// Each piece of 64 KiB is hashed at the first reading and again whenever it is read: a 2000th of
/// the file's size in memory.
class ProgramFile {
 public:
  /// @throw InputError naming the path if it is missing, is no regular file or cannot be read;
  ///        Interrupted
  explicit ProgramFile(const std::filesystem::path& path, const RunControl& control = {});

  [[nodiscard]] const JobIdentity& identity() const;
  /// Its bytes from the first on; seekable, and independent of this object's life. Reading throws
  /// RunError naming the path if the file is not what it was.
  [[nodiscard]] std::unique_ptr<std::istream> open() const;

 private:
  std::shared_ptr<const ProgramPieces> pieces_;
};

}  // namespace lensforge
