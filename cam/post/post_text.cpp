// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/post_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr std::array<std::string_view, 9> kPlaceholders = {
    "job", "number", "tool", "rpm", "dwell", "safe_z", "tolerance", "coolant", "coolant_off"};

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

bool is_plain(char c) {
  const bool printable = c >= ' ' && c < '\x7f';
  return printable && std::string_view("()?!~").find(c) == std::string_view::npos;
}

std::size_t comment_room(const PostDescription& post) {
  return post.longest_line - post.comment_open.size() - post.comment_close.size();
}

}  // namespace

bool is_placeholder(std::string_view name) {
  return std::find(kPlaceholders.begin(), kPlaceholders.end(), name) != kPlaceholders.end();
}

std::optional<std::string> fill_line(std::string_view line, const PlaceholderTexts& texts) {
  std::string filled;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t open = std::min(line.find('{', at), line.size());
    filled += line.substr(at, open - at);
    if (open == line.size()) break;
    const std::size_t close = line.find('}', open);
    LF_CHECK(close != std::string_view::npos, std::string(line));
    const auto text = texts.find(line.substr(open + 1, close - open - 1));
    if (text == texts.end() || text->second.empty()) return std::nullopt;
    filled += text->second;
    at = close + 1;
  }
  return filled;
}

std::string feed_text(const PostDescription& post, double feed) {
  const double least = std::pow(10.0, -post.feed_decimals);
  std::string text = trimmed_decimal(std::max(feed, least), post.feed_decimals);
  if (post.whole_with_point && text.find('.') == std::string::npos) text += '.';
  return text;
}

/// Whole units with the point put in.
void append_coordinate(std::string& line, std::int64_t units, int decimals,
                       const PostDescription& post) {
  if (units < 0) line += '-';
  std::array<char, 24> digits{};
  const auto [end, error] =
      std::to_chars(digits.data(), digits.data() + digits.size(), units < 0 ? -units : units);
  LF_CHECK(error == std::errc(), std::to_string(units));
  const auto length = static_cast<std::size_t>(end - digits.data());
  const auto after = static_cast<std::size_t>(decimals);
  const std::size_t whole = length > after ? length - after : 0;
  line.append(digits.data(), whole);
  if (whole == 0) line += '0';
  if (decimals > 0 || post.whole_with_point) line += '.';
  line.append(after - (length - whole), '0');
  line.append(digits.data() + whole, length - whole);
  if (post.trailing_zeros || decimals == 0) return;
  line.erase(line.find_last_not_of('0') + 1);
  if (line.back() == '.' && !post.whole_with_point) line.pop_back();
}

std::string comment_text(const PostDescription& post, std::string_view text, std::size_t longest) {
  std::string clean(text.substr(0, longest));
  std::replace_if(
      clean.begin(), clean.end(), [](char c) { return !is_plain(c); }, '_');
  if (post.upper_case_comments) std::transform(clean.begin(), clean.end(), clean.begin(), upper);
  return clean;
}

std::string comment_line(const PostDescription& post, std::string_view text) {
  return post.comment_open + comment_text(post, text, comment_room(post)) + post.comment_close;
}

std::string padded_comment_line(const PostDescription& post, std::string_view text) {
  std::string padded(text.substr(0, comment_room(post)));
  padded.resize(comment_room(post), ' ');
  return comment_line(post, padded);
}

}  // namespace lensforge
