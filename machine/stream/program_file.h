// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <string>

#include "core/compute/executor.h"

namespace lensforge {

/// Identity of a job's program, by content: the name does not matter.
struct JobIdentity {
  std::string sha256;      ///< Hash of the whole file, 64 hexadecimal digits.
  std::int64_t bytes = 0;  ///< Its size.
  std::string name;        ///< File name without folder, for display only.

  [[nodiscard]] bool same_program(const JobIdentity& other) const {
    return sha256 == other.sha256 && bytes == other.bytes;
  }
};

struct ProgramPieces;

/// A program that is read once when opened; later reads return the same bytes or fail. If the file
/// is replaced, overwritten, truncated or extended meanwhile, nothing is checked or sent that does
/// not belong to identity().
///
/// Each piece of 64 KiB is hashed at the first reading and again whenever it is read; the hashes
/// take 1/2000 of the file's size in memory.
class ProgramFile {
 public:
  /// @throw InputError naming the path if it is missing, is no regular file or cannot be read;
  ///        Interrupted
  explicit ProgramFile(const std::filesystem::path& path, const RunControl& control = {});

  [[nodiscard]] const JobIdentity& identity() const;
  /// Returns a seekable stream of its bytes, independent of this object's life. Reading throws
  /// RunError naming the path if the file has changed.
  [[nodiscard]] std::unique_ptr<std::istream> open() const;

 private:
  std::shared_ptr<const ProgramPieces> pieces_;
};

}  // namespace lensforge
