// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_text.h"

#include <cerrno>
#include <system_error>

#include "cam/post/post_text.h"
#include "core/error.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;  ///< Collected before it goes to the file.

}  // namespace

ProgramText::ProgramText(const PostDescription& post, const std::filesystem::path& path)
    : post_(post),
      file_(path),
      out_(file_.beside(), std::ios::binary | std::ios::trunc),
      number_(post.first_number) {
  check();
}

void ProgramText::line(std::string_view text) {
  const bool numbered =
      post_.numbers == LineNumbers::kAll || (post_.numbers == LineNumbers::kOperations && marked_);
  marked_ = false;
  if (!numbered) return plain_line(text);
  numbered_.assign(1, 'N');
  numbered_ += std::to_string(number_);
  if (post_.spaces) numbered_ += ' ';
  numbered_ += text;
  number_ += post_.number_step;
  if (number_ > post_.largest_number) number_ = post_.first_number;
  plain_line(numbered_);
}

void ProgramText::plain_line(std::string_view text) {
  if (text.size() > post_.longest_line) {
    throw InputError("post " + post_.name + ": line " + std::to_string(lines_ + 1) + " has " +
                     std::to_string(text.size()) + " characters, more than lines.longest, " +
                     std::to_string(post_.longest_line) + ": '" + std::string(text) + "'");
  }
  put(text);
}

void ProgramText::put(std::string_view text) {
  buffer_ += text;
  buffer_ += post_.crlf ? "\r\n" : "\n";
  bytes_ += text.size() + (post_.crlf ? 2 : 1);
  ++lines_;
  if (buffer_.size() >= kBufferBytes) flush();
}

void ProgramText::reserve(int comments) {
  flush();
  reserved_ = comments;
  reserved_at_ = out_.tellp();
  for (int i = 0; i < comments; ++i) put(padded_comment_line(post_, ""));
  put(comment_line(post_, seal_text(std::string(kSha256Digits, '0'))));
  flush();
  sealed_ = true;
}

/// Closed early, so that any number of parts may wait for the last one.
void ProgramText::close() {
  flush();
  buffer_.shrink_to_fit();
  sha256_ = hash_.finish();
  out_.close();
  check();
}

void ProgramText::finish(const std::vector<std::string>& comments) {
  LF_CHECK(static_cast<int>(comments.size()) == reserved_, std::to_string(comments.size()));
  out_.open(file_.beside(), std::ios::binary | std::ios::in | std::ios::out);
  out_.seekp(reserved_at_);
  const char* end = post_.crlf ? "\r\n" : "\n";
  for (const std::string& comment : comments) out_ << padded_comment_line(post_, comment) << end;
  out_ << comment_line(post_, seal_text(sha256_)) << end;
  out_.close();
  check();
}

void ProgramText::flush() {
  if (sealed_) hash_.update(buffer_);
  out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  buffer_.clear();
  check();
}

void ProgramText::check() {
  if (out_) return;
  const int error = errno != 0 ? errno : EIO;
  throw RunError(file_.path().string() +
                 ": cannot be written: " + std::generic_category().message(error));
}

}  // namespace lensforge
