// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"

namespace lensforge {

/// A program line was refused: "line 12: reason".
class GcodeError : public InputError {
 public:
  /// @param line  counted from 1.
  GcodeError(std::int64_t line, const std::string& reason)
      : InputError("line " + std::to_string(line) + ": " + reason), line_(line) {}

  [[nodiscard]] std::int64_t line() const { return line_; }

 private:
  std::int64_t line_;
};

/// One line of a program as in the file.
struct GcodeText {
  std::string_view text;         ///< Without its end; valid until the next line is read.
  std::int64_t line = 0;         ///< Counted from 1.
  std::int64_t offset = 0;       ///< Offset of its first byte in the file.
  std::int64_t next_offset = 0;  ///< Offset of the next line's first byte.
  /// A comment contains bytes that are not allowed outside comments: the line must be sent without
  /// its comments or not at all.
  bool unsafe_comment = false;
};

/// Reads a program line by line, of any size, in constant memory. LF, CR LF and CR end a line and
/// may be mixed; the last line needs no end.
///
/// Outside comments only tab and printable ASCII except ? ! ~ are accepted: a Grbl-family
/// controller acts on those, and on 0x80 … 0xFF, anywhere in a line.
class GcodeReader {
 public:
  static constexpr std::size_t kLongestLine = 256;

  /// @param in  must outlive the reader; opened as binary; read from its current position.
  explicit GcodeReader(std::istream& in, std::size_t longest_line = kLongestLine);

  /// Returns the next line; empty at the end of the file.
  /// @throw GcodeError naming line, byte and rule; RunError if the file cannot be read.
  std::optional<GcodeText> next();

  /// Continues at `offset`, where `line` begins. @pre both come from next(); the stream is
  /// seekable.
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
  std::size_t begin_ = 0;  ///< First unread byte of the buffer.
  std::size_t end_ = 0;
  std::string text_;
  Comment comment_ = Comment::kNone;  ///< Kind of comment at the current byte.
  bool unsafe_comment_ = false;
  std::int64_t offset_ = 0;
  std::int64_t line_ = 0;
};

/// A letter and its number.
struct GcodeWord {
  char letter = 0;     ///< Upper case.
  double value = 0.0;  ///< As written, in the program's units.
  int tenths = 0;      ///< G and M words: ten times the number; G91.1 is 911.
};

/// The words of one line.
class GcodeBlock {
 public:
  static constexpr std::size_t kMaxWords = 32;

  std::int64_t line = 0;               ///< Line in the file, from 1.
  std::int64_t offset = 0;             ///< Offset of the line's first byte.
  std::optional<std::int64_t> number;  ///< The N word.
  bool percent = false;                ///< The line is the % that begins or ends the program.

  /// All words except N, in order.
  [[nodiscard]] std::span<const GcodeWord> words() const { return {words_.data(), size_}; }
  /// True if the line has only blanks and comments, or %.
  [[nodiscard]] bool empty() const { return size_ == 0 && !number; }
  /// The value of a letter that occurs at most once (any but G and M).
  [[nodiscard]] std::optional<double> value(char letter) const;
  /// @pre fewer than kMaxWords so far.
  void add(const GcodeWord& word) { words_[size_++] = word; }

 private:
  std::array<GcodeWord, kMaxWords> words_;
  std::size_t size_ = 0;
};

/// Splits a line into words. Comments are (…) and everything after ;. Letters may be lower case;
/// blanks are allowed between words and after a letter.
///
/// Refused: nested and unclosed comments, exponents, numbers that are missing, broken by blanks or
/// comments, or longer than a controller reads (8 digits before the point, 16 in all), a repeated
/// letter (except G and M), G and M with more than one decimal, expressions and parameters, block
/// delete (Grbl would run the line), a % together with anything else.
/// @throw GcodeError
GcodeBlock parse_gcode_block(const GcodeText& text);

/// Returns a line as a controller needs it: upper case, without blanks, comments and, unless
/// `keep_number`, its N word; empty for % lines. @pre parse_gcode_block() accepts the line.
std::string compact_gcode(std::string_view text, bool keep_number);

}  // namespace lensforge
