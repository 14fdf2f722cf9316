// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/gcode_summary.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <string_view>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge::app {
namespace {

constexpr std::size_t kMaxHeaderLines = 12;
/// Longer than any controller takes by far.
constexpr std::size_t kLongestLine = 4096;

/// Reads up to the next line end, and of a line that is too long only so much that this shows.
bool next_line(std::ifstream& file, std::string& line) {
  line.clear();
  int c = file.get();
  const bool any = c != std::ifstream::traits_type::eof();
  for (; c != std::ifstream::traits_type::eof() && c != '\n'; c = file.get()) {
    line += static_cast<char>(c);
    if (line.size() > kLongestLine) break;
  }
  return any;
}

struct SplitLine {
  std::string code;     ///< Upper case, without spaces and comments.
  std::string comment;  ///< Text of the comments.
};

SplitLine split(const std::string& line) {
  SplitLine parts;
  bool in_brackets = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (!in_brackets && c == ';') {
      parts.comment += line.substr(i + 1);
      break;
    }
    if (c == '(' || c == ')') {
      in_brackets = c == '(';
    } else if (in_brackets) {
      parts.comment += c;
    } else if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      parts.code += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  return parts;
}

/// Whether a controller computes what the line says: #1, #<name>, [1+2], O<name> CALL. Its numbers
/// and letters then mean something else than words.
bool computes(std::string_view code) {
  return code.find_first_of("#[]<>=") != std::string_view::npos;
}

/// Takes the line's X, Y and Z words into `box`. @return whether there was one.
bool take_words(std::string_view code, Eigen::AlignedBox3d& box) {
  bool any = false;
  for (std::size_t i = 0; i + 1 < code.size(); ++i) {
    const std::size_t axis = std::string_view("XYZ").find(code[i]);
    if (axis == std::string_view::npos) continue;
    double value = 0.0;
    const auto [end, error] =
        std::from_chars(code.data() + i + 1, code.data() + code.size(), value);
    if (error != std::errc()) continue;
    const auto k = static_cast<Eigen::Index>(axis);
    box.min()[k] = std::min(box.min()[k], value);
    box.max()[k] = std::max(box.max()[k], value);
    any = true;
  }
  return any;
}

}  // namespace

GcodeSummary summarise_gcode(const std::filesystem::path& path) {
  std::ifstream file = open_input(path);
  GcodeSummary summary;
  bool in_header = true;
  for (std::string line; next_line(file, line); ++summary.lines) {
    const bool zero = line.find('\0') != std::string::npos;
    if (zero || line.size() > kLongestLine) {
      throw InputError(path.string() + ": line " + std::to_string(summary.lines + 1) +
                       ": not G-code, it " +
                       (zero ? "holds a zero byte"
                             : "is longer than " + std::to_string(kLongestLine) + " characters"));
    }
    const SplitLine parts = split(line);
    in_header = in_header && (parts.code.empty() || parts.code == "%");
    if (in_header && !parts.comment.empty() && summary.header.size() < kMaxHeaderLines) {
      summary.header.push_back(parts.comment);
    }
    if (computes(parts.code)) {
      if (summary.passed_over++ == 0) summary.first_passed = summary.lines + 1;
    } else if (take_words(parts.code, summary.extent)) {
      ++summary.moves;
    }
  }
  return summary;
}

}  // namespace lensforge::app
