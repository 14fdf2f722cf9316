// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

/// How a record of the journal stands in the file: eight hexadecimal digits of its CRC-32, a blank,
/// one JSON object, a line feed.
namespace lensforge::journal_text {

inline constexpr const char* kFormat = "lensforge.journal";
inline constexpr int kVersion = 1;
inline constexpr std::size_t kLongestLine = 4096;

/// The line of a record, with its end.
std::string line_of(const nlohmann::json& record);

/// Reads a line without its end; nothing if the check sum or the form is wrong.
std::optional<nlohmann::json> record_of(std::string_view line);

/// Whether a line is the first one of a journal, of whatever version.
bool begins_journal(std::string_view line);

}  // namespace lensforge::journal_text
