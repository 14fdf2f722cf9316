// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/program_seal.h"

#include <algorithm>
#include <fstream>
#include <vector>

#include "core/error.h"
#include "core/sha256.h"

namespace lensforge {
namespace {

constexpr std::string_view kPrefix = "sha256 below ";
constexpr int kLinesOfHeader = 200;
constexpr std::size_t kLongestLine = 256;  ///< Of a header's line.
constexpr std::size_t kPiece = 1 << 16;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool is_hexadecimal(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }

std::string hash_of_rest(std::ifstream& file) {
  Sha256 hash;
  std::vector<char> piece(kPiece);
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    hash.update({piece.data(), static_cast<std::size_t>(file.gcount())});
  }
  return hash.finish();
}

/// The next line with its end cut off; nothing at the end of the file or of a line too long for a
/// header.
std::optional<std::string> header_line(std::ifstream& file) {
  std::string line;
  for (int c = file.get(); c != std::ifstream::traits_type::eof(); c = file.get()) {
    if (c == '\n') return line;
    line += static_cast<char>(c);
    if (line.size() > kLongestLine) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::string seal_text(std::string_view sha256) { return std::string(kPrefix).append(sha256); }

std::optional<std::string> stated_hash(std::string_view line) {
  std::string text(line);
  std::transform(text.begin(), text.end(), text.begin(), lower);
  if (text.empty() || (text.front() != '(' && text.front() != ';')) return std::nullopt;
  if (text.compare(1, kPrefix.size(), kPrefix) != 0) return std::nullopt;
  std::string hash = text.substr(1 + kPrefix.size(), kSha256Digits);
  if (hash.size() != kSha256Digits || !std::all_of(hash.begin(), hash.end(), is_hexadecimal)) {
    return std::nullopt;
  }
  return hash;
}

std::optional<bool> check_seal(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path.string() + ": cannot be read");
  for (int i = 0; i < kLinesOfHeader; ++i) {
    const auto line = header_line(file);
    if (!line) return std::nullopt;
    if (const auto stated = stated_hash(*line)) return hash_of_rest(file) == *stated;
  }
  return std::nullopt;
}

}  // namespace lensforge
