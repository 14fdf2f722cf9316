// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

#include "core/compute/executor.h"

namespace lensforge {

/// Recognises the lines of a program's header, which move and set nothing: blank lines, comments,
/// one % as the first word of the file, and one program number (O1001) after it. Each may have a
/// line number (N10).
class HeaderLines {
 public:
  /// True if the next line, given without its end, belongs to the header. False for bytes other
  /// than printable ASCII and for unclosed or nested comments.
  bool take(std::string_view line);
  /// True if a ; came after % or O: controls that use these may read it as the end of a block.
  [[nodiscard]] bool semicolon_on_tape() const { return semicolon_on_tape_; }

 private:
  bool take_tape_word(std::string_view& rest);

  bool begun_ = false;     ///< A line that is not blank was read.
  bool tape_ = false;      ///< % or an O number was read.
  bool numbered_ = false;  ///< An O number was read.
  bool semicolon_on_tape_ = false;
};

/// Number of digits of the SHA-256 in a seal.
constexpr std::size_t kSha256Digits = 64;

/// Text of a program's seal: a comment line in its header with the SHA-256 of all bytes below it,
/// which reveals that a program was changed or truncated.
std::string seal_text(std::string_view sha256);

/// The hash in a seal line, in lower case; empty if the line is anything but a seal.
std::optional<std::string> stated_hash(std::string_view line);

/// True if a program is as cam wrote it: the seal matches the bytes below it, and only comments, %,
/// a program number and line numbers are above it. Also false if a line names cam as the author or
/// mentions a seal and no seal holds. Empty for a program from another source. Reads the whole
/// program in constant memory.
/// @throw Interrupted; what reading throws
std::optional<bool> check_seal(std::istream& program, const RunControl& control = {});

/// check_seal() of a file. @throw InputError if it cannot be read.
std::optional<bool> check_seal(const std::filesystem::path& path);

}  // namespace lensforge
