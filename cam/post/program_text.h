// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "cam/post/post_description.h"
#include "core/io/files.h"
#include "core/io/sha256.h"

namespace lensforge {

/// The text of one program on its way into a file: counts lines and bytes, numbers lines, keeps
/// room for comments that are known only at the end, and hashes what stands below them. Constant
/// memory.
class ProgramText {
 public:
  /// @throw RunError naming the file if it cannot be made.
  ProgramText(const PostDescription& post, const std::filesystem::path& path);

  /// One line, without its end. @throw InputError if it is longer than the dialect allows.
  void line(std::string_view text);
  /// A line of the dialect's own that is no G-code words: %, comments.
  void plain_line(std::string_view text);
  /// The next line() begins an operation.
  void mark_operation() { marked_ = true; }
  /// Keeps room for `comments` comment lines and the seal; what follows is sealed. Once only.
  void reserve(int comments);
  /// Brings all that was written into the file and closes it.
  void close();
  /// Fills the reserved lines in, the seal included (machine/gcode/program_seal.h).
  /// @pre close() was called, and as many comments as were reserved. @throw RunError (disk full,
  /// …).
  void finish(const std::vector<std::string>& comments);

  [[nodiscard]] std::int64_t lines() const { return lines_; }
  [[nodiscard]] std::uintmax_t bytes() const { return bytes_; }
  /// Of all below the seal; after finish().
  [[nodiscard]] const std::string& sha256() const { return sha256_; }
  [[nodiscard]] PendingFile& file() { return file_; }
  [[nodiscard]] const PendingFile& file() const { return file_; }

 private:
  void put(std::string_view text);
  void flush();
  void check();

  const PostDescription& post_;
  PendingFile file_;
  std::ofstream out_;
  std::string buffer_;
  std::string numbered_;
  Sha256 hash_;
  std::string sha256_;
  bool sealed_ = false;
  bool marked_ = false;
  int reserved_ = 0;
  std::ofstream::pos_type reserved_at_{};
  std::int64_t lines_ = 0;
  std::uintmax_t bytes_ = 0;
  std::int64_t number_;
};

}  // namespace lensforge
