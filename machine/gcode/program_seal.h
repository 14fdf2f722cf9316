// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

#include "core/compute/run_control.h"

namespace lensforge {

/// Tells the lines of a program's header, which move and set nothing, from all others: blank lines,
/// comments, one % as the first word of the file, and one program number (O1001) behind it. A line
/// number (N10) may stand before any.
class HeaderLines {
 public:
  /// Whether the next line, without its end, belongs to a header. What is not printable ASCII, a
  /// comment that is not closed or holds another does not.
  bool take(std::string_view line);
  /// Whether a ; stood behind % or O: such controls may take it for the end of a block.
  [[nodiscard]] bool semicolon_on_tape() const { return semicolon_on_tape_; }

 private:
  bool take_tape_word(std::string_view& rest);

  bool begun_ = false;     ///< A line that is not blank has passed.
  bool tape_ = false;      ///< % or an O number has passed.
  bool numbered_ = false;  ///< An O number has passed.
  bool semicolon_on_tape_ = false;
};

/// Digits of a SHA-256 in a seal.
constexpr std::size_t kSha256Digits = 64;

/// The seal of a program: a comment line of its header that states the SHA-256 of every byte below
/// it, so that a program that was changed or cut short can be told. This is the comment's text.
std::string seal_text(std::string_view sha256);

/// The hash that a line of a program states, in lower case; nothing if the line is anything else
/// than a seal, alone.
std::optional<std::string> stated_hash(std::string_view line);

/// Whether a program is as cam wrote it: the bytes below its seal are those that it states, and
/// nothing but comments, %, a program number and line numbers stand above it. False as well if a
/// line says that cam wrote it, or speaks of a seal, and there is none that holds. Nothing for a
/// program of somebody else. Reads all of it in constant memory.
/// @throw Interrupted; what reading throws
std::optional<bool> check_seal(std::istream& program, const RunControl& control = {});

/// check_seal() of a file. @throw InputError if it cannot be read.
std::optional<bool> check_seal(const std::filesystem::path& path);

}  // namespace lensforge
