// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/pnm_outline.h"

#include <algorithm>
#include <cstddef>
#include <vector>

// OpenImageIO divides by a maximum of 0, wraps values above the maximum and fills missing pixels
// with black. Layout: Netpbm, "pbm(5)", "pgm(5)", "ppm(5)".
namespace lensforge {
namespace {

constexpr int kEndOfFile = -1;
constexpr std::int64_t kMaxNumber = 1 << 30;

bool is_digit(int c) { return c >= '0' && c <= '9'; }
bool is_blank(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Skips blanks and comments; the next character stays in the stream.
int next_character(std::streambuf& bytes) {
  for (;;) {
    int c = bytes.sgetc();
    if (c == '#') {
      while (c != kEndOfFile && c != '\n') c = bytes.snextc();
    } else if (is_blank(c)) {
      bytes.sbumpc();
    } else {
      return c;
    }
  }
}

/// The next whole number; −1 if there is none. Reads at most `digits` digits.
std::int64_t next_number(std::streambuf& bytes, int digits = 10) {
  int c = next_character(bytes);
  if (!is_digit(c)) return -1;
  std::int64_t number = 0;
  for (; is_digit(c) && digits > 0; c = bytes.snextc(), --digits) {
    number = std::min(10 * number + (c - '0'), kMaxNumber);
  }
  return number;
}

bool has_floats(char kind) { return kind == 'f' || kind == 'F'; }
bool has_colour(char kind) { return kind == '3' || kind == '6' || kind == 'F'; }
bool has_bits(char kind) { return kind == '1' || kind == '4'; }

std::int64_t samples_per_row(const PnmOutline& pnm) {
  return pnm.columns * (has_colour(pnm.kind) ? 3 : 1);
}

std::string value_problem(const PnmOutline& pnm, std::int64_t value, std::int64_t row) {
  return "row " + std::to_string(row) + " has the value " + std::to_string(value) +
         ": at most the header's maximum of " + std::to_string(pnm.max_value) + " is allowed there";
}

std::string missing_problem(const PnmOutline& pnm, std::int64_t row) {
  return "is truncated: its data end in row " + std::to_string(row) + " of " +
         std::to_string(pnm.rows);
}

/// Returns why a row of numbers as text contradicts the header.
std::string text_row_problem(std::streambuf& bytes, const PnmOutline& pnm, std::int64_t row) {
  const int digits = has_bits(pnm.kind) ? 1 : 10;  // The bits of PBM need no blanks between.
  for (std::int64_t i = 0; i < samples_per_row(pnm); ++i) {
    const std::int64_t value = next_number(bytes, digits);
    if (value < 0 && bytes.sgetc() != kEndOfFile) {
      return "row " + std::to_string(row) + " has something that is no number";
    }
    if (value < 0) return missing_problem(pnm, row);
    if (value > pnm.max_value) return value_problem(pnm, value, row);
  }
  return {};
}

std::int64_t bytes_per_row(const PnmOutline& pnm) {
  if (pnm.kind == '4') return (pnm.columns + 7) / 8;
  if (has_floats(pnm.kind)) return 4 * samples_per_row(pnm);
  return samples_per_row(pnm) * (pnm.max_value < 256 ? 1 : 2);
}

/// The largest sample of a row of PGM or PPM.
std::int64_t largest_sample(const std::vector<char>& row, bool two_bytes) {
  std::int64_t largest = 0;
  for (std::size_t i = 0; i < row.size(); i += two_bytes ? 2 : 1) {
    std::int64_t value = static_cast<unsigned char>(row[i]);
    if (two_bytes) value = 256 * value + static_cast<unsigned char>(row[i + 1]);
    largest = std::max(largest, value);
  }
  return largest;
}

std::string binary_row_problem(std::streambuf& bytes, const PnmOutline& pnm, std::int64_t row,
                               std::vector<char>& buffer) {
  const auto size = static_cast<std::streamsize>(buffer.size());
  if (bytes.sgetn(buffer.data(), size) < size) return missing_problem(pnm, row);
  if (has_bits(pnm.kind) || has_floats(pnm.kind)) return {};
  const std::int64_t largest = largest_sample(buffer, pnm.max_value > 255);
  return largest > pnm.max_value ? value_problem(pnm, largest, row) : std::string();
}

}  // namespace

PnmOutline read_pnm_outline(std::istream& file) {
  std::streambuf& bytes = *file.rdbuf();
  PnmOutline pnm;
  bytes.sbumpc();  // 'P'
  pnm.kind = static_cast<char>(bytes.sbumpc());
  pnm.columns = next_number(bytes);
  pnm.rows = next_number(bytes);
  if (pnm.columns < 1 || pnm.rows < 1) {
    pnm.problem = "is corrupt: its PNM header has no size";
  } else if (has_floats(pnm.kind)) {
    // The scale, which OpenImageIO reads.
    for (int c = next_character(bytes); c != kEndOfFile && !is_blank(c); c = bytes.sgetc()) {
      bytes.sbumpc();
    }
  } else if (!has_bits(pnm.kind)) {
    pnm.max_value = next_number(bytes);
    if (pnm.max_value < 1 || pnm.max_value > 65535) {
      pnm.problem = "has a maximum of " + std::to_string(pnm.max_value) +
                    " in its PNM header: it must be in 1 to 65535";
    }
  }
  if (pnm.kind > '3') bytes.sbumpc();  // One blank separates header and pixels.
  return pnm;
}

std::string pnm_pixel_problem(std::istream& file, const PnmOutline& pnm) {
  std::streambuf& bytes = *file.rdbuf();
  const bool is_text = pnm.kind < '4';
  std::vector<char> buffer(is_text ? 0 : static_cast<std::size_t>(bytes_per_row(pnm)));
  for (std::int64_t row = 0; row < pnm.rows; ++row) {
    std::string problem =
        is_text ? text_row_problem(bytes, pnm, row) : binary_row_problem(bytes, pnm, row, buffer);
    if (!problem.empty()) return problem;
  }
  return {};
}

}  // namespace lensforge
