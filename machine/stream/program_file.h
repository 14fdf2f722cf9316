// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <string>

#include "core/compute/run_control.h"

namespace lensforge {

/// Which program a job runs: another file is another job, whatever its name.
struct JobIdentity {
  std::string sha256;      ///< Of the whole file, 64 hexadecimal digits.
  std::int64_t bytes = 0;  ///< Its size.
  std::string name;        ///< Its name without folder, for the reader's eyes only.

  [[nodiscard]] bool same_program(const JobIdentity& other) const {
    return sha256 == other.sha256 && bytes == other.bytes;
  }
};

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
