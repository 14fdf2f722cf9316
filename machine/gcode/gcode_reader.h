// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "machine/gcode/gcode_error.h"

namespace lensforge {

/// One line of a program as it stands in the file.
struct GcodeText {
  std::string_view text;         ///< Without its end; valid until the next line is read.
  std::int64_t line = 0;         ///< Counted from 1.
  std::int64_t offset = 0;       ///< Of its first byte in the file.
  std::int64_t next_offset = 0;  ///< Of the first byte after it and its end.
  /// A comment holds what may not stand outside of one: such a line is sent without its comments,
  /// or not at all.
  bool unsafe_comment = false;
};

/// Reads a program line by line, of any size, in constant memory. LF, CR LF and CR end a line, in
/// any mixture; the last one needs no end.
///
/// Outside of comments nothing but tab and printable ASCII passes, and of that none of ? ! ~: a
/// Grbl-family controller acts on those, and on 0x80 … 0xFF, wherever they stand.
class GcodeReader {
 public:
  static constexpr std::size_t kLongestLine = 256;

  /// @param in  must outlive the reader; opened as binary; read from where it stands.
  explicit GcodeReader(std::istream& in, std::size_t longest_line = kLongestLine);

  /// The next line, or nothing at the end of the file.
  /// @throw GcodeError naming line, byte and rule; RunError if the file cannot be read.
  std::optional<GcodeText> next();

  /// Goes on at `offset`, where `line` begins. @pre both as next() told them, of a seekable stream.
  void seek(std::int64_t offset, std::int64_t line);

 private:
  bool fill();
  int peek();
  void take(unsigned char byte);
  void follow_comment(unsigned char byte);
  void skip_line_end(unsigned char end);

  enum class Comment { kNone, kInBrackets, kToEnd };

  std::istream& in_;
  std::size_t longest_line_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;  ///< First byte of the buffer that is not read yet.
  std::size_t end_ = 0;
  std::string text_;
  Comment comment_ = Comment::kNone;  ///< What the bytes of the line are in by now.
  bool unsafe_comment_ = false;
  std::int64_t offset_ = 0;
  std::int64_t line_ = 0;
};

}  // namespace lensforge
