// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace lensforge {

/// Digits of a SHA-256 in a seal.
constexpr std::size_t kSha256Digits = 64;

/// The seal of a program: a comment line of its header that states the SHA-256 of every byte below
/// it, so that a program that was changed or cut short can be told. This is the comment's text.
std::string seal_text(std::string_view sha256);

/// The hash that a line of a program states, in lower case; nothing if the line is no seal.
std::optional<std::string> stated_hash(std::string_view line);

/// Whether a program's bytes below its seal are those that it states; nothing if there is no seal
/// among its first 200 lines. Constant memory. @throw InputError if the file cannot be read.
std::optional<bool> check_seal(const std::filesystem::path& path);

}  // namespace lensforge
