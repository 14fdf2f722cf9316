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

/// A line of a program that is refused: "line 12: reason".
class GcodeError : public InputError {
 public:
  /// @param line  counted from 1.
  GcodeError(std::int64_t line, const std::string& reason)
      : InputError("line " + std::to_string(line) + ": " + reason), line_(line) {}

  [[nodiscard]] std::int64_t line() const { return line_; }

 private:
  std::int64_t line_;
};

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

/// A letter and its number.
struct GcodeWord {
  char letter = 0;     ///< Upper case.
  double value = 0.0;  ///< As written, in the program's units.
  int tenths = 0;      ///< Of a G or M word: ten times its number, so that G91.1 is 911.
};

/// The words of one line.
class GcodeBlock {
 public:
  static constexpr std::size_t kMaxWords = 32;

  std::int64_t line = 0;               ///< In the file, counted from 1.
  std::int64_t offset = 0;             ///< Of the line's first byte.
  std::optional<std::int64_t> number;  ///< The N word.
  bool percent = false;                ///< The line is a % that begins or ends the program.

  /// All words but N, as they stand.
  [[nodiscard]] std::span<const GcodeWord> words() const { return {words_.data(), size_}; }
  /// Nothing but blanks and comments, or %.
  [[nodiscard]] bool empty() const { return size_ == 0 && !number; }
  /// The value of a letter that stands at most once (any but G and M).
  [[nodiscard]] std::optional<double> value(char letter) const;
  /// @pre fewer than kMaxWords so far.
  void add(const GcodeWord& word) { words_[size_++] = word; }

 private:
  std::array<GcodeWord, kMaxWords> words_;
  std::size_t size_ = 0;
};

/// Splits a line into words. Comments are (…) and from ; on; letters may be lower case; blanks may
/// stand between words and after a letter.
///
/// Refused: nested and unclosed comments, exponents, numbers that are missing, broken by blanks or
/// comments, or longer than a controller reads (8 digits before the point, 16 in all), a letter
/// twice (G and M apart), G and M with more than one decimal, expressions and parameters, block
/// delete (Grbl would run the line), a % beside anything else.
/// @throw GcodeError
GcodeBlock parse_gcode_block(const GcodeText& text);

/// What a controller needs to get of a line: upper case, without blanks, comments and, unless
/// `keep_number`, its N word; empty for % lines. @pre parse_gcode_block() took the line.
std::string compact_gcode(std::string_view text, bool keep_number);

}  // namespace lensforge
