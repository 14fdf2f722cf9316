// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/journal_text.h"

#include <zlib.h>

#include <array>
#include <cstdio>

#include "core/error.h"

namespace lensforge::journal_text {
namespace {

constexpr std::size_t kSumDigits = 8;

std::string check_sum(std::string_view text) {
  const auto* bytes = reinterpret_cast<const Bytef*>(text.data());
  const unsigned long sum = ::crc32(0, bytes, static_cast<uInt>(text.size()));
  std::array<char, kSumDigits + 1> digits{};
  std::snprintf(digits.data(), digits.size(), "%08lx", sum);
  return digits.data();
}

}  // namespace

std::string line_of(const nlohmann::json& record) {
  // What controllers say need not be UTF-8.
  const std::string text = record.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  LF_CHECK(text.size() + kSumDigits + 2 <= kLongestLine, text);
  return check_sum(text) + ' ' + text + '\n';
}

std::optional<nlohmann::json> record_of(std::string_view line) {
  if (line.size() <= kSumDigits || line[kSumDigits] != ' ') return std::nullopt;
  const std::string_view text = line.substr(kSumDigits + 1);
  if (check_sum(text) != line.substr(0, kSumDigits)) return std::nullopt;
  nlohmann::json record = nlohmann::json::parse(text, nullptr, false);
  if (!record.is_object()) return std::nullopt;
  return record;
}

bool begins_journal(std::string_view line) {
  const std::optional<nlohmann::json> record = record_of(line);
  return record && record->contains("format") && (*record)["format"] == kFormat;
}

}  // namespace lensforge::journal_text
