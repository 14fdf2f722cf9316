// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/mutation.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <iterator>
#include <vector>

namespace lensforge::fuzz {
namespace {

constexpr std::size_t kHeaderBytes = 96;      ///< Where formats keep sizes and counts.
constexpr std::size_t kLongWord = 100'000;    ///< Letters: more than any line should hold.
constexpr std::size_t kDeepNesting = 20'000;  ///< Brackets: more than a stack of 8 MB may hold.

/// A part of a text: first byte and how many.
struct Span {
  std::size_t at = 0;
  std::size_t size = 0;
};

Span some_span(const std::string& text, std::size_t longest, Random& random) {
  if (text.empty()) return {};
  const std::size_t at = random.below(text.size());
  return {at, 1 + random.below(std::min(longest, text.size() - at))};
}

/// Runs of characters for which `belongs` holds.
template <class Belongs>
std::vector<Span> spans(const std::string& text, const Belongs& belongs) {
  std::vector<Span> found;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!belongs(text[i])) continue;
    if (!found.empty() && found.back().at + found.back().size == i) {
      ++found.back().size;
    } else {
      found.push_back({i, 1});
    }
  }
  return found;
}

bool in_number(char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-'; }
bool in_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || in_number(c);
}
bool in_line(char c) { return c != '\n'; }

void replace(std::string& text, const Span& span, const std::string& by) {
  text.replace(span.at, span.size, by);
}

void replace_number(std::string& text, Random& random) {
  const std::vector<Span> numbers = spans(text, in_number);
  if (!numbers.empty()) replace(text, random.pick(numbers), hostile_number(random));
}

void replace_word(std::string& text, Random& random) {
  const std::vector<Span> words = spans(text, in_word);
  if (!words.empty()) replace(text, random.pick(words), hostile_word(random));
}

void swap_words(std::string& text, Random& random) {
  const std::vector<Span> words = spans(text, in_word);
  if (words.size() < 2) return;
  const std::size_t first = random.below(words.size() - 1);
  const Span a = words[first];
  const Span b = words[first + 1 + random.below(words.size() - first - 1)];
  const std::string was = text.substr(a.at, a.size);
  const std::string other = text.substr(b.at, b.size);
  replace(text, b, was);
  replace(text, a, other);
}

void change_lines(std::string& text, Random& random) {
  const std::vector<Span> lines = spans(text, in_line);
  if (lines.empty()) return;
  const Span line = random.pick(lines);
  const std::string copy = text.substr(line.at, line.size) + "\n";
  switch (random.below(4)) {
    case 0:
      text.erase(line.at, line.size);
      break;
    case 1:
      text.insert(random.pick(lines).at, copy);
      break;
    case 2:
      text.insert(line.at, copy);
      break;
    default:
      for (std::size_t i = 0; i < 1 + random.below(300); ++i) text.insert(line.at, copy);
  }
}

void nest(std::string& text, Random& random) {
  static const std::vector<std::string> kOpening{"[", "{", "(", "{\"a\":", "[[", "a.", "a = ["};
  const std::string& open = random.pick(kOpening);
  const std::size_t depth = random.one_in(2) ? kDeepNesting : 1 + random.below(300);
  std::string deep;
  for (std::size_t i = 0; i < depth; ++i) deep += open;
  text.insert(random.below(text.size() + 1), deep);
}

/// `value` as 1, 2, 4 or 8 bytes in either order.
std::string as_bytes(std::uint64_t value, Random& random) {
  std::string bytes(std::size_t{1} << random.below(4), '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<char>((value >> (8 * i)) & 0xFFU);
  }
  if (random.one_in(2)) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

void overwrite_count(std::string& data, Random& random) {
  static const std::vector<std::uint64_t> kCounts{0,
                                                  1,
                                                  0x7F,
                                                  0x80,
                                                  0xFF,
                                                  0x7FFF,
                                                  0x8000,
                                                  0xFFFF,
                                                  0x7FFFFFFF,
                                                  0x80000000,
                                                  0xFFFFFFFF,
                                                  0x100000000,
                                                  0x7FF80000,
                                                  0x7F800000,
                                                  0xFF800000,
                                                  0x7FF0000000000000,
                                                  0xFFFFFFFFFFFFFFFF};
  const std::string bytes = as_bytes(random.pick(kCounts), random);
  const std::size_t reach = random.one_in(3) ? data.size() : std::min(data.size(), kHeaderBytes);
  if (reach == 0) return;
  data.replace(random.below(reach), bytes.size(), bytes);
}

void move_block(std::string& data, Random& random) {
  const Span from = some_span(data, 4096, random);
  const std::string block = data.substr(from.at, from.size);
  if (random.one_in(2)) data.erase(from.at, from.size);
  const std::size_t copies = random.one_in(8) ? 1 + random.below(64) : 1;
  const std::size_t to = random.below(data.size() + 1);
  for (std::size_t i = 0; i < copies; ++i) data.insert(to, block);
}

void change_bytes(std::string& data, Random& random) {
  const Span span = some_span(data, 64, random);
  switch (random.below(7)) {
    case 0:
    case 1:
      if (!data.empty()) data[span.at] = static_cast<char>(data[span.at] ^ (1 << random.below(8)));
      break;
    case 2:
      overwrite_count(data, random);
      break;
    case 3:
      data.erase(span.at, span.size);
      break;
    case 4:
      data.resize(random.below(data.size() + 1));
      break;
    case 5:
      move_block(data, random);
      break;
    default:
      data.insert(span.at, random.bytes(1 + random.below(16)));
  }
}

void change_text(std::string& text, Random& random) {
  switch (random.below(10)) {
    case 0:
    case 1:
    case 2:
      return replace_number(text, random);
    case 3:
      return replace_word(text, random);
    case 4:
      return swap_words(text, random);
    case 5:
    case 6:
      return change_lines(text, random);
    case 7:
      if (random.one_in(3)) nest(text, random);
      return;
    case 8:
      text.insert(random.below(text.size() + 1), hostile_word(random));
      return;
    default:
      change_bytes(text, random);
  }
}

nlohmann::json hostile_value(Random& random) {
  using nlohmann::json;
  switch (random.below(9)) {
    case 0:
      return nullptr;
    case 1:
      return json::array();
    case 2:
      return json::object();
    case 3:
      return "text";
    case 4:
      return -1;
    case 5:
      return 1e308;
    case 6:
      return std::uint64_t{1} << 63U;
    case 7:
      return json::array({1, "two", nullptr, json::array({3.5})});
    default:
      return random.one_in(2) ? json(true) : json(0);
  }
}

/// Walks down to some value and changes it.
void change_value(nlohmann::json& value, Random& random) {
  nlohmann::json* at = &value;
  while (at->is_structured() && !at->empty() && !random.one_in(4)) {
    at = &*std::next(at->begin(), static_cast<std::ptrdiff_t>(random.below(at->size())));
  }
  if (at->is_structured() && !at->empty() && random.one_in(2)) {
    at->erase(std::next(at->begin(), static_cast<std::ptrdiff_t>(random.below(at->size()))));
    return;
  }
  *at = hostile_value(random);
}

/// The sum at the end of a checkpoint: FNV-1a, 64 bit, little-endian.
std::string checkpoint_sum(const std::string& content) {
  std::uint64_t value = 0xcbf29ce484222325U;
  for (const char c : content) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  std::string bytes;
  for (unsigned shift = 0; shift < 64; shift += 8) {
    bytes += static_cast<char>((value >> shift) & 0xFFU);
  }
  return bytes;
}

}  // namespace

std::string hostile_number(Random& random) {
  static const std::vector<std::string> kNumbers{"0",
                                                 "-0",
                                                 "-1",
                                                 "1",
                                                 "2",
                                                 "0.5",
                                                 "nan",
                                                 "-nan",
                                                 "inf",
                                                 "-inf",
                                                 "1e400",
                                                 "-1e400",
                                                 "1e308",
                                                 "-1e308",
                                                 "1e-308",
                                                 "1e-400",
                                                 "1e-12",
                                                 "1e-6",
                                                 "1e9",
                                                 "1e15",
                                                 "2147483647",
                                                 "2147483648",
                                                 "-2147483648",
                                                 "4294967295",
                                                 "4294967296",
                                                 "9223372036854775807",
                                                 "9223372036854775808",
                                                 "18446744073709551616",
                                                 "0x10",
                                                 "1e",
                                                 ".",
                                                 "1,5",
                                                 "1_000",
                                                 "007",
                                                 "+5",
                                                 "1.0000000001",
                                                 "1000000",
                                                 "16384",
                                                 "65535",
                                                 "1e1",
                                                 "3mm",
                                                 "1e999999999",
                                                 "0.1.2",
                                                 "--5",
                                                 "1e5mm"};
  switch (random.below(12)) {
    case 0:
      return std::string(300, '9');
    case 1:
      return "0." + std::string(300, '0') + "1";
    case 2:
      return std::to_string(random.below(1000));
    case 3:
      return std::to_string(random.unit() * 100.0);
    default:
      return random.pick(kNumbers);
  }
}

std::string hostile_word(Random& random) {
  static const std::vector<std::string> kWords{"\x1b[2J\x1b]0;title\x07",
                                               "\xFF\xFE",
                                               "\xC3",
                                               "\xED\xA0\x80",
                                               "\xC2\x9B"
                                               "31m",
                                               "\r\nlensforge: all is well\r\n",
                                               "\t",
                                               "%s%n%d",
                                               "\"",
                                               "'",
                                               "\\",
                                               "../../etc",
                                               "\xE2\x80\xAE"
                                               "abc",
                                               "NULL",
                                               "true",
                                               "nan",
                                               "#",
                                               "[",
                                               "{}",
                                               "=",
                                               "()",
                                               ";",
                                               "*",
                                               "?x=1",
                                               "\x7F\x01\x02",
                                               "-",
                                               "--",
                                               "--force",
                                               "\xEF\xBB\xBF",
                                               "$HOME",
                                               "`id`"};
  switch (random.below(12)) {
    case 0:
      return std::string(random.one_in(3) ? kLongWord : 300, 'w');
    case 1:
      return std::string(1, '\0') + "after";
    case 2:
      return random.bytes(1 + random.below(12));
    default:
      return random.pick(kWords);
  }
}

std::string mutated_bytes(std::string data, Random& random) {
  for (std::size_t i = 0; i < 1 + random.below(4); ++i) change_bytes(data, random);
  return data;
}

std::string mutated_text(std::string text, Random& random) {
  for (std::size_t i = 0; i < 1 + random.below(4); ++i) change_text(text, random);
  return text;
}

std::string mutated_json(const std::string& text, Random& random) {
  if (random.one_in(3)) return mutated_text(text, random);
  nlohmann::json value = nlohmann::json::parse(text);
  for (std::size_t i = 0; i < 1 + random.below(2); ++i) change_value(value, random);
  // Most of what is changed stands on one line.
  const std::string changed = value.dump(text.find('\n') == std::string::npos ? -1 : 2);
  return random.one_in(4) ? mutated_text(changed, random) : changed;
}

std::string mutated_checkpoint(const std::string& good, Random& random) {
  constexpr std::size_t kSum = 8;
  std::string content = good.substr(0, good.size() - kSum);
  const std::size_t header = content.find('\n') + 1;
  const std::size_t numbers = content.find('\n', header);
  const std::string json = content.substr(header, numbers - header);
  switch (random.below(3)) {
    case 0:
      content = content.substr(0, header) + mutated_json(json, random) + content.substr(numbers);
      break;
    case 1:
      content = content.substr(0, numbers) + mutated_bytes(content.substr(numbers), random);
      break;
    default:
      return mutated_bytes(good, random);
  }
  return content + checkpoint_sum(content);
}

}  // namespace lensforge::fuzz
