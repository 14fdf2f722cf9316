// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lensforge {

/// A text file of a mesh, line by line and word by word. Lines end with LF, CR LF or CR; a byte
/// order mark before the first is skipped.
class MeshText {
 public:
  enum class Form {
    kPlain,
    kHashComments,    ///< '#' begins a comment.
    kContinuedLines,  ///< The same, and a backslash at its end continues a line.
  };

  /// @param name    what to call the file in messages.
  /// @param before  number of lines of the file before `text`.
  /// @pre `text` outlives this.
  MeshText(std::string_view text, std::string name, Form form, std::int64_t before = 0);

  /// Goes to the next line that holds a word; false at the end of the text.
  bool next_line();
  /// The next word of this line; empty at its end.
  std::string_view word();
  /// The next word of this line or of the lines after it. @throw InputError at the end of the text.
  std::string_view word_of_any_line(const std::string& meaning);

  /// The next word of this line as a number; "nan" and "inf" are numbers here.
  double number(const std::string& meaning);
  /// `word` as a number, or as a whole number.
  [[nodiscard]] double number_from(std::string_view word, const std::string& meaning) const;
  [[nodiscard]] std::int64_t whole_from(std::string_view word, const std::string& meaning) const;

  [[nodiscard]] std::int64_t line() const { return line_; }
  /// Offset of the next line.
  [[nodiscard]] std::size_t end_of_line() const { return next_; }

  /// @throw InputError "name: line N: why".
  [[noreturn]] void refuse(const std::string& why) const;

 private:
  bool take_line();
  bool at_word();

  std::string_view text_;
  std::string name_;
  Form form_;
  std::string_view rest_;   ///< Rest of this line.
  bool continues_ = false;  ///< The next line continues this one.
  std::size_t next_ = 0;
  std::int64_t line_;
};

/// `text` without leading byte order mark and white space.
std::string_view without_lead(std::string_view text);

/// True if two words are equal apart from capitals (ASCII).
bool same_word(std::string_view a, std::string_view small_letters);

/// A word of a file for a message: short and printable, in quotes.
std::string quoted_word(std::string_view word);

}  // namespace lensforge
