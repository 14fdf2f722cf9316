// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <ios>

#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;
constexpr int kEnd = -1;

std::string hexadecimal(unsigned char byte) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%02X", static_cast<unsigned>(byte));
  return text.data();
}

/// Reason for which a byte is not allowed in a program; empty if it is.
std::string reason_against(unsigned char byte) {
  if (byte == '?' || byte == '!' || byte == '~' || byte == 0x18 || byte >= 0x80) {
    return "the controller treats this byte as a realtime command anywhere in a line";
  }
  if (byte == 0x00) return "NUL in the text";
  if ((byte < 0x20 && byte != '\t') || byte == 0x7F) return "control byte in the text";
  return {};
}

[[noreturn]] void refuse_byte(std::int64_t line, std::size_t column, unsigned char byte,
                              const std::string& reason) {
  // A multi-byte sign at the very beginning is most likely the mark that editors put there.
  const bool mark = line == 1 && column == 1 && byte == 0xEF;
  throw GcodeError(line, "byte " + hexadecimal(byte) + " in column " + std::to_string(column) +
                             ": " + (mark ? "UTF-8 byte order mark; " : "") + reason);
}

}  // namespace

GcodeReader::GcodeReader(std::istream& in, std::size_t longest_line)
    : in_(in), longest_line_(longest_line), buffer_(kBufferBytes) {
  text_.reserve(longest_line_);
}

std::optional<GcodeText> GcodeReader::next() {
  if (peek() == kEnd) return std::nullopt;
  text_.clear();
  comment_ = Comment::kNone;
  unsafe_comment_ = false;
  ++line_;
  GcodeText read;
  read.line = line_;
  read.offset = offset_;
  for (int byte = peek(); byte != kEnd; byte = peek()) {
    ++begin_;
    ++offset_;
    if (byte == '\n' || byte == '\r') {
      skip_line_end(static_cast<unsigned char>(byte));
      break;
    }
    take(static_cast<unsigned char>(byte));
  }
  read.text = text_;
  read.next_offset = offset_;
  read.unsafe_comment = unsafe_comment_;
  return read;
}

void GcodeReader::seek(std::int64_t offset, std::int64_t line) {
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(offset));
  if (!in_) throw RunError("the program cannot be read at byte " + std::to_string(offset));
  begin_ = end_ = 0;
  offset_ = offset;
  line_ = line - 1;
}

bool GcodeReader::fill() {
  in_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  if (in_.bad()) throw RunError("the program cannot be read after line " + std::to_string(line_));
  begin_ = 0;
  end_ = static_cast<std::size_t>(in_.gcount());
  return end_ > 0;
}

int GcodeReader::peek() {
  if (begin_ == end_ && !fill()) return kEnd;
  return static_cast<unsigned char>(buffer_[begin_]);
}

void GcodeReader::take(unsigned char byte) {
  const std::size_t column = text_.size() + 1;
  if (column > longest_line_) {
    throw GcodeError(line_, "longer than " + std::to_string(longest_line_) + " characters");
  }
  const bool plain = byte >= ' ' && byte < 0x7F && byte != '?' && byte != '!' && byte != '~';
  if (!plain) {
    const std::string reason = reason_against(byte);
    const bool refused = !reason.empty();
    if (refused && comment_ == Comment::kNone) refuse_byte(line_, column, byte, reason);
    unsafe_comment_ = unsafe_comment_ || refused;
  }
  follow_comment(byte);
  text_ += static_cast<char>(byte);
}

void GcodeReader::follow_comment(unsigned char byte) {
  if (comment_ == Comment::kNone && byte == '(') comment_ = Comment::kInBrackets;
  if (comment_ == Comment::kNone && byte == ';') comment_ = Comment::kToEnd;
  if (comment_ == Comment::kInBrackets && byte == ')') comment_ = Comment::kNone;
}

void GcodeReader::skip_line_end(unsigned char end) {
  if (end == '\r' && peek() == '\n') {
    ++begin_;
    ++offset_;
  }
}

namespace {

constexpr std::size_t kMaxWholeDigits = 8;
constexpr std::size_t kMaxDigits = 16;

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return upper(c) >= 'A' && upper(c) <= 'Z'; }

/// Walks along one line.
class LineScanner {
 public:
  LineScanner(std::string_view text, std::int64_t line) : text_(text), line_(line) {}

  [[nodiscard]] bool at_end() const { return at_ == text_.size(); }
  [[nodiscard]] char peek() const { return at_end() ? '\0' : text_[at_]; }
  char take() { return text_[at_++]; }

  void skip_blanks() {
    while (!at_end() && is_blank(text_[at_])) ++at_;
  }

  void skip_blanks_and_comments() {
    for (skip_blanks(); peek() == '(' || peek() == ';'; skip_blanks()) {
      if (peek() == ';') at_ = text_.size();
      if (peek() == '(') skip_brackets();
    }
  }

  /// Reads the digits, signs and points at this position.
  double number(char letter) {
    const std::size_t begin = at_;
    if (peek() == '+' || peek() == '-') ++at_;
    const std::size_t digits_begin = at_;
    const std::size_t whole = skip_digits();
    std::size_t digits = whole;
    if (peek() == '.') {
      ++at_;
      digits += skip_digits();
    }
    const std::string_view written = text_.substr(begin, at_ - begin);
    refuse_bad_number(letter, written, whole, digits);
    double value = 0.0;
    std::from_chars(text_.data() + digits_begin, text_.data() + at_, value,
                    std::chars_format::fixed);
    return text_[begin] == '-' ? -value : value;
  }

  [[noreturn]] void refuse(const std::string& reason) const { throw GcodeError(line_, reason); }

 private:
  std::size_t skip_digits() {
    const std::size_t begin = at_;
    while (!at_end() && is_digit(text_[at_])) ++at_;
    return at_ - begin;
  }

  void skip_brackets() {
    const std::size_t end = text_.find_first_of("()", at_ + 1);
    if (end == std::string_view::npos) refuse("comment without its closing bracket");
    if (text_[end] == '(') refuse("comment inside a comment");
    at_ = end + 1;
  }

  void refuse_bad_number(char letter, std::string_view written, std::size_t whole,
                         std::size_t digits) const {
    const std::string name = std::string(1, letter).append(written);
    if (digits == 0) refuse("'" + name + "': a number is missing after " + letter);
    if (whole > kMaxWholeDigits || digits > kMaxDigits) {
      refuse("'" + name + "': longer than " + std::to_string(kMaxWholeDigits) +
             " digits before the point or " + std::to_string(kMaxDigits) + " in all");
    }
    const bool exponent =
        upper(peek()) == 'E' && at_ + 1 < text_.size() &&
        (is_digit(text_[at_ + 1]) || text_[at_ + 1] == '+' || text_[at_ + 1] == '-');
    if (exponent) refuse("'" + name + peek() + "': numbers with an exponent are not G-code");
  }

  std::string_view text_;
  std::int64_t line_;
  std::size_t at_ = 0;
};

[[noreturn]] void refuse_sign(const LineScanner& scanner, char sign) {
  switch (sign) {
    case '#':
    case '[':
    case ']':
      scanner.refuse(std::string("'") + sign + "': parameters and expressions are not supported");
    case '/':
      scanner.refuse("'/': block delete is not supported; the controller would run the line");
    case ')':
      scanner.refuse("')' without an opening bracket");
    case '$':
      scanner.refuse("'$': a controller's command, not G-code");
    case '%':
      scanner.refuse("'%' must be alone on its line");
    default:
      scanner.refuse(std::string("'") + sign + "' where a letter is expected");
  }
}

int tenths_of(const LineScanner& scanner, const GcodeWord& word) {
  const double tenths = word.value * 10.0;
  const double rounded = std::round(tenths);
  if (word.value < 0.0 || word.value >= 1000.0 || std::abs(tenths - rounded) > 1e-6) {
    scanner.refuse(std::string(1, word.letter) + shortest_text(word.value) + ": unknown word");
  }
  return static_cast<int>(rounded);
}

std::int64_t line_number(const LineScanner& scanner, double value) {
  if (value < 0.0 || value != std::floor(value)) {
    scanner.refuse("N" + shortest_text(value) + ": line numbers are integers, 0 or above");
  }
  return static_cast<std::int64_t>(value);
}

void add_word(LineScanner& scanner, GcodeBlock& block) {
  GcodeWord word;
  word.letter = upper(scanner.take());
  scanner.skip_blanks();
  word.value = scanner.number(word.letter);
  if (word.letter == 'N') {
    if (block.number) scanner.refuse("N is given twice");
    block.number = line_number(scanner, word.value);
    return;
  }
  if (word.letter == 'G' || word.letter == 'M') {
    word.tenths = tenths_of(scanner, word);
  } else if (block.value(word.letter)) {
    scanner.refuse(std::string(1, word.letter) + " is given twice");
  }
  if (block.words().size() == GcodeBlock::kMaxWords) {
    scanner.refuse("more than " + std::to_string(GcodeBlock::kMaxWords) + " words");
  }
  block.add(word);
}

bool is_percent_line(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  return first != std::string_view::npos && text[first] == '%' &&
         text.find_first_not_of(" \t", first + 1) == std::string_view::npos;
}

}  // namespace

std::optional<double> GcodeBlock::value(char letter) const {
  for (const GcodeWord& word : words()) {
    if (word.letter == letter) return word.value;
  }
  return std::nullopt;
}

GcodeBlock parse_gcode_block(const GcodeText& text) {
  GcodeBlock block;
  block.line = text.line;
  block.offset = text.offset;
  block.percent = is_percent_line(text.text);
  if (block.percent) return block;
  LineScanner scanner(text.text, text.line);
  for (scanner.skip_blanks_and_comments(); !scanner.at_end(); scanner.skip_blanks_and_comments()) {
    if (!is_letter(scanner.peek())) refuse_sign(scanner, scanner.peek());
    add_word(scanner, block);
  }
  return block;
}

std::string compact_gcode(std::string_view text, bool keep_number) {
  std::string compact;
  compact.reserve(text.size());
  bool in_brackets = false;
  bool in_number_word = false;
  for (const char c : text) {
    if (in_brackets) {
      in_brackets = c != ')';
    } else if (c == '(') {
      in_brackets = true;
    } else if (c == ';' || c == '%') {
      break;
    } else if (!is_blank(c)) {
      if (is_letter(c)) in_number_word = upper(c) == 'N';
      if (!in_number_word || keep_number) compact += upper(c);
    }
  }
  return compact;
}

}  // namespace lensforge
