// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

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

}  // namespace lensforge
