// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/program_seal.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/words.h"

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

/// The rest of a line after its comments in brackets.
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

/// @return false for a misplaced % or O.
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

namespace {

constexpr std::string_view kPrefix = "sha256 below ";
/// Comments that cam writes into every program, and no other software does, in lower case.
constexpr std::array<std::string_view, 2> kMarks = {
    "sha256 below", "units: mm; x0 y0: lower left corner of the lens"};
/// Followed by a number: a version.
constexpr std::string_view kProgram = "lensforge ";
constexpr std::size_t kLongestLine = 1024;  ///< The rest of a longer line is ignored.
constexpr std::size_t kPiece = 1 << 16;

std::string lower_case(std::string_view line) {
  std::string text(line);
  std::transform(text.begin(), text.end(), text.begin(), lower);
  return text;
}

bool is_hexadecimal(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }

/// True if the line has a comment that only cam writes.
bool speaks_of_cam(std::string_view line) {
  if (line.find_first_of("(;") == std::string_view::npos) return false;
  const std::string text = lower_case(line);
  for (const std::string_view mark : kMarks) {
    if (text.find(mark) != std::string::npos) return true;
  }
  const std::size_t program = text.find(kProgram);
  if (program == std::string::npos || program + kProgram.size() >= text.size()) return false;
  const char next = text[program + kProgram.size()];
  return next >= '0' && next <= '9';
}

/// Searches for the seal line by line, then hashes the bytes below it. As for GcodeReader, lines
/// end with LF, CR LF or CR.
class SealScan {
 public:
  void take(std::string_view bytes) {
    while (!bytes.empty() && !hashing_) take_line(bytes);
    if (hashing_) hash_.update(bytes);
  }

  /// The rest of the file cannot change the result.
  [[nodiscard]] bool settled() const { return cams_ && !header_ && !hashing_; }

  std::optional<bool> result() {
    if (hashing_) return hash_.finish() == stated_;
    judge();
    return cams_ ? std::optional(false) : std::nullopt;
  }

 private:
  /// Takes bytes up to the end of a line, or all.
  void take_line(std::string_view& bytes) {
    if (ends_with_cr_ && bytes.front() != '\n') end_line(false);
    const std::size_t end = std::min({bytes.find('\n'), bytes.find('\r'), bytes.size()});
    line_ += bytes.substr(0, std::min(end, kLongestLine + 1 - line_.size()));
    const bool at_end = end == bytes.size();
    const char last = at_end ? '\0' : bytes[end];
    bytes.remove_prefix(at_end ? end : end + 1);
    if (last == '\r') ends_with_cr_ = true;
    if (last == '\n') end_line(true);
  }

  /// cam ends the seal with LF or CR LF: what a single CR ends is no seal.
  void end_line(bool with_lf) {
    const std::optional<std::string> hash = stated_hash(line_);
    const bool header = judge();
    const bool in_doubt = lines_.semicolon_on_tape() && line_.starts_with('(');
    if (hash && header && with_lf && !in_doubt) {
      stated_ = *hash;
      hashing_ = true;
    }
    line_.clear();
    ends_with_cr_ = false;
  }

  /// @return whether nothing but a header was seen so far.
  bool judge() {
    cams_ = cams_ || speaks_of_cam(line_);
    header_ = header_ && line_.size() <= kLongestLine && lines_.take(line_);
    return header_;
  }

  HeaderLines lines_;
  bool header_ = true;
  bool cams_ = false;
  bool hashing_ = false;
  bool ends_with_cr_ = false;
  std::string line_;
  std::string stated_;
  Sha256 hash_;
};

}  // namespace

std::string seal_text(std::string_view sha256) { return std::string(kPrefix).append(sha256); }

std::optional<std::string> stated_hash(std::string_view line) {
  const std::string text = lower_case(line);
  if (text.empty() || (text.front() != '(' && text.front() != ';')) return std::nullopt;
  const std::string_view close = text.front() == '(' ? ")" : "";
  if (text.size() != 1 + kPrefix.size() + kSha256Digits + close.size()) return std::nullopt;
  if (text.compare(1, kPrefix.size(), kPrefix) != 0 || !text.ends_with(close)) return std::nullopt;
  std::string hash = text.substr(1 + kPrefix.size(), kSha256Digits);
  if (!std::all_of(hash.begin(), hash.end(), is_hexadecimal)) return std::nullopt;
  return hash;
}

std::optional<bool> check_seal(std::istream& program, const RunControl& control) {
  SealScan scan;
  std::vector<char> piece(kPiece);
  while (program && !scan.settled()) {
    if (control.stop_requested()) throw Interrupted();
    program.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    scan.take({piece.data(), static_cast<std::size_t>(program.gcount())});
  }
  return scan.result();
}

std::optional<bool> check_seal(const std::filesystem::path& path) {
  std::ifstream file = open_input(path);
  return check_seal(file);
}

}  // namespace lensforge
