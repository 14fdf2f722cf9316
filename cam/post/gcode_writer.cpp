// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/gcode_writer.h"

#include <charconv>
#include <cmath>
#include <cstddef>

#include "core/decimal_text.h"
#include "core/error.h"

namespace lensforge {
namespace {

constexpr std::size_t kLongestLine = 80;       ///< Grbl 1.1 refuses more with error:11.
constexpr std::size_t kBufferBytes = 1 << 16;  ///< Text collected before it goes to the stream.

/// A number of up to six decimals without trailing zeros: feeds, speeds, seconds, tolerances.
std::string plain_number(double value) {
  std::string text = decimal_text(value, 6);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string comment_line(std::string_view text) {
  std::string line = "(";
  line += text.substr(0, kLongestLine - 2);
  line += ')';
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    const bool printable = line[i] >= ' ' && line[i] < '\x7f';
    if (!printable || std::string_view("()?!~").find(line[i]) != std::string_view::npos) {
      line[i] = '_';
    }
  }
  return line;
}

/// A reserved comment is as long as a line may be, so that any other fits in its place.
std::string padded_comment(std::string_view text) {
  std::string padded(text.substr(0, kLongestLine - 2));
  padded.resize(kLongestLine - 2, ' ');
  return comment_line(padded);
}

}  // namespace

Post parse_post(std::string_view name) {
  for (const Post post : {Post::kLinuxcnc, Post::kGrbl}) {
    if (name == post_name(post)) return post;
  }
  throw InputError("--post: '" + std::string(name) + "' is none of linuxcnc, grbl");
}

std::string_view post_name(Post post) { return post == Post::kGrbl ? "grbl" : "linuxcnc"; }

GcodeWriter::GcodeWriter(std::ostream& out, const GcodeOptions& options)
    : out_(out), options_(options), scale_(std::pow(10.0, options.decimals)) {}

void GcodeWriter::begin(const std::vector<std::string>& comments, int reserved) {
  for (const std::string& comment : comments) line(comment_line(comment));
  flush();
  reserved_ = reserved;
  reserved_at_ = out_.tellp();
  for (int i = 0; i < reserved; ++i) line(padded_comment(""));
  line("G21 G90 G17 G94");
  line("G40 G49 G80");
  line("G54");
  if (options_.post == Post::kLinuxcnc) {
    if (options_.blend_tolerance > 0.0) {
      line(std::string("G64 P").append(plain_number(options_.blend_tolerance)));
    }
    line("T1 M6");
  }
  move(0, {std::nullopt, std::nullopt, options_.safe_z}, std::nullopt);
  line(std::string("S").append(plain_number(options_.spindle_rpm)).append(" M3"));
  if (options_.spin_up > 0.0) line(std::string("G4 P").append(plain_number(options_.spin_up)));
}

void GcodeWriter::plunge_to(const Eigen::Vector3d& point) {
  move(0, {std::nullopt, std::nullopt, options_.safe_z}, std::nullopt);
  move(0, {point.x(), point.y(), std::nullopt}, std::nullopt);
  move(1, {std::nullopt, std::nullopt, point.z()}, options_.plunge);
}

void GcodeWriter::cut_to(const Eigen::Vector3d& point) {
  move(1, {point.x(), point.y(), point.z()}, options_.feed);
}

void GcodeWriter::end() {
  move(0, {std::nullopt, std::nullopt, options_.safe_z}, std::nullopt);
  line("M5");
  line("M2");
  flush();
}

void GcodeWriter::fill_in(const std::vector<std::string>& comments) {
  LF_CHECK(static_cast<int>(comments.size()) == reserved_, std::to_string(comments.size()));
  const auto end = out_.tellp();
  out_.seekp(reserved_at_);
  for (const std::string& comment : comments) out_ << padded_comment(comment) << '\n';
  out_.seekp(end);
}

void GcodeWriter::move(int motion, const std::array<std::optional<double>, 3>& target,
                       std::optional<double> feed) {
  words_.clear();
  // A motion word without a coordinate is an error to some controllers, so a move to where the
  // tool already is leaves no line.
  std::array<std::optional<std::int64_t>, 3> units;
  bool moves = false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!target[k]) continue;
    units[k] = std::llround(*target[k] * scale_);
    moves = moves || units[k] != position_[k];
  }
  if (!moves) return;
  if (motion_ != motion) words_ += motion == 0 ? "G0" : "G1";
  motion_ = motion;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!units[k] || units[k] == position_[k]) continue;
    add_coordinate("XYZ"[k], *units[k]);
    position_[k] = units[k];
  }
  if (feed && feed_ != feed) {
    words_.append(" F").append(plain_number(*feed));
    feed_ = feed;
  }
  // The feed is stated again after every rapid, so that a program can be picked up there.
  if (motion == 0) feed_.reset();
  line(words_);
}

/// Whole units with the point put in: exact, no exponent, no negative zero, no locale.
void GcodeWriter::add_coordinate(char letter, std::int64_t units) {
  if (!words_.empty()) words_ += ' ';
  words_ += letter;
  if (units < 0) words_ += '-';
  char digits[24];
  const auto [end, error] =
      std::to_chars(digits, digits + sizeof digits, units < 0 ? -units : units);
  LF_CHECK(error == std::errc(), std::to_string(units));
  const auto length = static_cast<std::size_t>(end - digits);
  const auto decimals = static_cast<std::size_t>(options_.decimals);
  const std::size_t zeros = length > decimals ? 0 : decimals + 1 - length;
  std::string number(zeros, '0');
  number.append(digits, length);
  if (decimals > 0) number.insert(number.size() - decimals, 1, '.');
  words_ += number;
}

void GcodeWriter::line(std::string_view text) {
  LF_CHECK(text.size() <= kLongestLine, std::string(text));
  buffer_ += text;
  buffer_ += '\n';
  ++lines_;
  if (buffer_.size() >= kBufferBytes) flush();
}

void GcodeWriter::flush() {
  out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  buffer_.clear();
}

}  // namespace lensforge
