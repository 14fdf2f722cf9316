// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/mesh_text.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/text/printable.h"

namespace lensforge {
namespace {

constexpr std::string_view kBlanks = " \t\v\f";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kLongestShownWord = 40;

char small(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// std::from_chars takes no plus sign.
std::string_view without_plus(std::string_view word) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+';
  return plus ? word.substr(1) : word;
}

}  // namespace

MeshText::MeshText(std::string_view text, std::string name, Form form, std::int64_t before)
    : text_(text), name_(std::move(name)), form_(form), line_(before) {
  if (text_.starts_with(kByteOrderMark)) next_ = kByteOrderMark.size();
}

/// The next physical line; false at the end of the text.
bool MeshText::take_line() {
  continues_ = false;
  rest_ = {};
  if (next_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find_first_of("\r\n", next_), text_.size());
  rest_ = text_.substr(next_, end - next_);
  next_ = std::min(end + (text_.substr(end).starts_with("\r\n") ? 2 : 1), text_.size());
  ++line_;
  if (form_ == Form::kPlain) return true;
  // A comment ends with its line, even after a backslash.
  rest_ = rest_.substr(0, rest_.find('#'));
  const std::size_t last = rest_.find_last_not_of(kBlanks);
  continues_ =
      form_ == Form::kContinuedLines && last != std::string_view::npos && rest_[last] == '\\';
  if (continues_) rest_ = rest_.substr(0, last);
  return true;
}

/// Moves to the next word of this line, if any.
bool MeshText::at_word() {
  for (;;) {
    const std::size_t begin = rest_.find_first_not_of(kBlanks);
    if (begin != std::string_view::npos) {
      rest_.remove_prefix(begin);
      return true;
    }
    if (!continues_ || !take_line()) return false;
  }
}

bool MeshText::next_line() {
  while (continues_) take_line();
  while (take_line()) {
    if (at_word()) return true;
  }
  return false;
}

std::string_view MeshText::word() {
  if (!at_word()) return {};
  const std::string_view found = rest_.substr(0, rest_.find_first_of(kBlanks));
  rest_.remove_prefix(found.size());
  return found;
}

std::string_view MeshText::word_of_any_line(const std::string& meaning) {
  for (;;) {
    if (const std::string_view found = word(); !found.empty()) return found;
    if (!next_line()) refuse("is truncated: " + meaning + " is missing");
  }
}

double MeshText::number(const std::string& meaning) { return number_from(word(), meaning); }

double MeshText::number_from(std::string_view word, const std::string& meaning) const {
  if (word.empty()) refuse(meaning + " is missing");
  const std::string_view digits = without_plus(word);
  const char* const end = digits.data() + digits.size();
  double value = 0.0;
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) {
    refuse(meaning + " is " + quoted_word(word) + ": it must be a number");
  }
  // Too large a number becomes infinite, too small a one 0.
  return error == std::errc() ? value : std::strtod(std::string(digits).c_str(), nullptr);
}

std::int64_t MeshText::whole_from(std::string_view word, const std::string& meaning) const {
  if (word.empty()) refuse(meaning + " is missing");
  const std::string_view digits = without_plus(word);
  const char* const end = digits.data() + digits.size();
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  if (stop != end || error != std::errc()) {
    refuse(meaning + " is " + quoted_word(word) + ": it must be a whole number");
  }
  return value;
}

void MeshText::refuse(const std::string& why) const {
  throw InputError(name_ + ": line " + std::to_string(line_) + ": " + why);
}

std::string_view without_lead(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t\v\f\r\n"), text.size()));
  return text;
}

bool same_word(std::string_view a, std::string_view small_letters) {
  return std::equal(a.begin(), a.end(), small_letters.begin(), small_letters.end(),
                    [](char x, char y) { return small(x) == y; });
}

std::string quoted_word(std::string_view word) {
  std::string text("'");
  text += printable_line(word, kLongestShownWord);
  text += '\'';
  return text;
}

}  // namespace lensforge
