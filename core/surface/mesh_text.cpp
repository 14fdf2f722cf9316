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

constexpr std::string_view kBlanks = " \t\r\v\f";
constexpr std::size_t kLongestShownWord = 40;

char small(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// std::from_chars takes no plus sign.
std::string_view without_plus(std::string_view word) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+';
  return plus ? word.substr(1) : word;
}

}  // namespace

MeshText::MeshText(std::string_view text, std::string name, Comments comments, std::int64_t before)
    : text_(text), name_(std::move(name)), comments_(comments), line_(before) {}

bool MeshText::next_line() {
  while (next_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', next_), text_.size());
    rest_ = text_.substr(next_, end - next_);
    next_ = std::min(end + 1, text_.size());
    ++line_;
    if (comments_ == Comments::kHash) rest_ = rest_.substr(0, rest_.find('#'));
    if (rest_.find_first_not_of(kBlanks) != std::string_view::npos) return true;
  }
  rest_ = {};
  return false;
}

std::string_view MeshText::word() {
  const std::size_t begin = rest_.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  const std::size_t end = std::min(rest_.find_first_of(kBlanks, begin), rest_.size());
  const std::string_view found = rest_.substr(begin, end - begin);
  rest_.remove_prefix(end);
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
  // Too large becomes infinite, too small 0.
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
