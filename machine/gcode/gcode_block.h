// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "machine/gcode/gcode_reader.h"

namespace lensforge {

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
