// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

namespace lensforge {

/// Fowler–Noll–Vo 1a, 64 bit.
class Fnv1a {
 public:
  void add(std::string_view bytes) {
    for (const char c : bytes) {
      value_ = (value_ ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    }
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

template <class T>
std::string_view bytes_of(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

/// A fingerprint as 16 hexadecimal digits: JSON's numbers do not hold 64 bits.
std::string fingerprint_text(std::uint64_t fingerprint);

/// Content of a checkpoint: a JSON header and little-endian numbers.
struct CheckpointContent {
  nlohmann::json header;
  std::string numbers;
};

/// Name of a checkpoint's header in messages.
std::string checkpoint_header_name(const std::filesystem::path& path);

/// @throw InputError "checkpoint 'path' why".
[[noreturn]] void refuse_checkpoint(const std::filesystem::path& path, const std::string& why);

/// Writes the magic line, the header on one line, the numbers and a check sum of all of it; whole
/// or not at all. @param magic  ends with a line feed. @throw RunError if it cannot be written.
void write_checkpoint_file(const std::filesystem::path& path, std::string_view magic,
                           const CheckpointContent& content);

/// @throw InputError if the file is missing, truncated, damaged, has another magic line or a header
///        that is no JSON.
CheckpointContent read_checkpoint_file(const std::filesystem::path& path, std::string_view magic);

}  // namespace lensforge
