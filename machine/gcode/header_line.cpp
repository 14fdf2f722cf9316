// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/header_line.h"

#include <algorithm>

namespace lensforge {
namespace {

constexpr std::string_view kBlanks = " \t";
constexpr std::string_view kDigits = "0123456789";

std::string_view without_blanks(std::string_view text) {
  return text.substr(std::min(text.find_first_not_of(kBlanks), text.size()));
}

bool is_text(std::string_view line) {
  return std::all_of(line.begin(), line.end(),
                     [](char c) { return c == '\t' || (c >= ' ' && c < '\x7F'); });
}

/// Takes a word such as N10 off the front, with the blanks behind it. @return whether it was there.
bool take_number(std::string_view& rest, char letter) {
  if (rest.empty() || (rest.front() & ~0x20) != letter) return false;
  const std::size_t end = std::min(rest.find_first_not_of(kDigits, 1), rest.size());
  if (end == 1) return false;
  rest = without_blanks(rest.substr(end));
  return true;
}

/// What is left behind comments in brackets.
std::string_view behind_comments(std::string_view rest) {
  while (rest.starts_with('(')) {
    const std::size_t end = rest.find_first_of("()", 1);
    if (end == std::string_view::npos || rest[end] == '(') return rest;
    rest = without_blanks(rest.substr(end + 1));
  }
  return rest;
}

}  // namespace

bool HeaderLines::take(std::string_view line) {
  std::string_view rest = without_blanks(line);
  if (rest.empty()) return true;
  if (!is_text(line)) return false;
  const bool tape_word = take_tape_word(rest);
  begun_ = true;
  rest = behind_comments(rest);
  semicolon_on_tape_ = semicolon_on_tape_ || (tape_ && rest.starts_with(';'));
  return tape_word && (rest.empty() || rest.front() == ';');
}

/// @return false for a % or O where none may stand.
bool HeaderLines::take_tape_word(std::string_view& rest) {
  if (rest.front() == '%') {
    if (begun_) return false;
    tape_ = true;
    rest = without_blanks(rest.substr(1));
    return rest.empty();
  }
  take_number(rest, 'N');
  if (!take_number(rest, 'O')) return true;
  if (numbered_) return false;
  numbered_ = tape_ = true;
  return true;
}

}  // namespace lensforge
