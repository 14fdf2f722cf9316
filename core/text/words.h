// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <initializer_list>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// The text with A to Z as a to z and all other bytes unchanged, in any locale.
std::string lower_case(std::string text);

/// A to Z for a to z, and the other way round; all other bytes unchanged.
constexpr char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }
constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Concatenates the texts.
inline std::string joined(std::initializer_list<std::string_view> texts) {
  std::string all;
  for (const std::string_view text : texts) all.append(text);
  return all;
}

/// The text with a capital letter first.
inline std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = upper(text[0]);
  return text;
}

/// The words of a range with `between` between them. @param words  strings or views of them.
template <class Words>
std::string joined(const Words& words, std::string_view between) {
  std::string text;
  bool first = true;
  for (const std::string_view word : words) {
    if (!first) text += between;
    text += word;
    first = false;
  }
  return text;
}

/// Appends a word to a list, after ", " unless it is the first. @return the longer list.
inline std::string with_word(std::string list, std::string_view word,
                             std::string_view between = ", ") {
  if (!list.empty()) list += between;
  return list += word;
}

/// The parts of a text between separators: one more than there are separators.
/// @return views of `text`.
inline std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

/// The text without these characters around it. @return a view of `text`.
inline std::string_view trimmed(std::string_view text, std::string_view around = " \t\r\n") {
  const std::size_t first = text.find_first_not_of(around);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(around) - first + 1);
}

/// The known word that was most likely meant by a mistyped one; empty if none is near.
std::string nearest_word(const std::string& word, const std::set<std::string>& known);

/// Maximum length of a printed message, bytes: about ten lines of a terminal.
inline constexpr std::size_t kMaxMessageBytes = 1000;

/// Foreign text (file names, contents of files, replies of devices) as one line without effect on a
/// terminal: white space becomes a space, every other control character (C0, DEL, C1) and every
/// byte that is not UTF-8 becomes '?'. In a longer text " ... " replaces the middle, between
/// characters. @pre max_bytes ≥ 16
std::string printable_line(std::string_view text, std::size_t max_bytes = kMaxMessageBytes);

/// printable_line() of each line of a text; none is cut.
std::string printable_lines(std::string_view text);

}  // namespace lensforge
