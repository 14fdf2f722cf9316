// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/words.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

namespace lensforge {
namespace {

constexpr std::size_t kMaxEdits = 2;  ///< For a mistyped word: two letters swapped.

/// Insertions, deletions and replacements that turn one text into the other (Levenshtein).
std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t before = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = before + (a[i - 1] == b[j - 1] ? 0 : 1);
      before = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, replaced}));
    }
  }
  return row.back();
}

}  // namespace

std::string lower_case(std::string text) {
  for (char& c : text) c = lower(c);
  return text;
}

std::string nearest_word(const std::string& word, const std::set<std::string>& known) {
  std::string nearest;
  std::size_t least = kMaxEdits + 1;
  for (const std::string& candidate : known) {
    if (word.size() > candidate.size() + kMaxEdits) continue;
    const std::size_t edits = edits_between(word, candidate);
    if (edits >= least || edits >= candidate.size()) continue;
    nearest = candidate;
    least = edits;
  }
  return nearest;
}

namespace {

constexpr std::string_view kCut = " ... ";

bool continues(unsigned char byte) { return (byte & 0xC0U) == 0x80U; }

/// Bytes of the character that begins with `lead`; 0 if none does.
std::size_t length_of(unsigned char lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead < 0xE0) return 2;
  if (lead >= 0xE0 && lead < 0xF0) return 3;
  return lead >= 0xF0 && lead < 0xF5 ? 4 : 0;
}

/// The first character of `text` as a number, and its bytes; 0 bytes if it is not UTF-8 (RFC 3629:
/// no overlong forms, no surrogates, none above U+10FFFF).
struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;
};

Character first_character(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  const std::size_t bytes = length_of(lead);
  if (bytes == 0 || bytes > text.size()) return {};
  std::uint32_t code = bytes == 1 ? lead : lead & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    if (!continues(next)) return {};
    code = code << 6U | (next & 0x3FU);
  }
  const bool overlong = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  const bool surrogate = code >= 0xD800 && code < 0xE000;
  return overlong || surrogate || code > 0x10FFFF ? Character{} : Character{code, bytes};
}

/// C0, DEL, C1, and the marks that change the text direction.
bool is_control(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029 ||
         (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

bool is_white(std::uint32_t code) { return code == ' ' || (code >= '\t' && code <= '\r'); }

std::string harmless(std::string_view text) {
  std::string line;
  line.reserve(text.size());
  while (!text.empty()) {
    const Character next = first_character(text);
    const std::size_t bytes = next.bytes == 0 ? 1 : next.bytes;
    if (next.bytes != 0 && is_white(next.code)) {
      line += ' ';
    } else if (next.bytes == 0 || is_control(next.code)) {
      line += '?';
    } else {
      line += text.substr(0, bytes);
    }
    text.remove_prefix(bytes);
  }
  return line;
}

bool inside_character(const std::string& line, std::size_t at) {
  return at < line.size() && continues(static_cast<unsigned char>(line[at]));
}

}  // namespace

std::string printable_line(std::string_view text, std::size_t max_bytes) {
  while (!text.empty() && is_white(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
  // Only the ends of a long text are examined; a character takes four bytes at most.
  std::string cut_text;
  if (text.size() > 4 * max_bytes) {
    cut_text.append(text.substr(0, 2 * max_bytes)).append(text.substr(text.size() - 2 * max_bytes));
    text = cut_text;
  }
  std::string line = harmless(text);
  if (line.size() <= max_bytes) return line;
  std::size_t head = (max_bytes - kCut.size()) / 2;
  std::size_t tail = line.size() - (max_bytes - kCut.size() - head);
  while (inside_character(line, head)) --head;
  while (inside_character(line, tail)) ++tail;
  return line.substr(0, head).append(kCut).append(line.substr(tail));
}

std::string printable_lines(std::string_view text) {
  std::string lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines += harmless(text.substr(0, end));
    if (end < text.size()) lines += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

}  // namespace lensforge
