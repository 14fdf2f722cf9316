// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_reader.h"

#include <array>
#include <cstdio>
#include <ios>

namespace lensforge {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;
constexpr int kEnd = -1;

std::string hexadecimal(unsigned char byte) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%02X", static_cast<unsigned>(byte));
  return text.data();
}

/// Why a byte may not stand in a program, or empty.
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

}  // namespace lensforge
