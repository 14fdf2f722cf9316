// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/checkpoint_file.h"

#include <array>
#include <bit>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/json.h"

namespace lensforge {
namespace {

/// A checkpoint has 48 bytes per vertex: the limit is 178 million vertices.
constexpr std::uintmax_t kMaxBytes = std::uintmax_t{8} << 30U;

static_assert(std::endian::native == std::endian::little, "checkpoints are little-endian");

std::string read_bytes(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    refuse_checkpoint(path, "cannot be read: there is nothing to resume from");
  }
  return read_whole_file(path, kMaxBytes);
}

}  // namespace

std::string fingerprint_text(std::uint64_t fingerprint) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016" PRIx64, fingerprint);
  return text.data();
}

std::string checkpoint_header_name(const std::filesystem::path& path) {
  return "checkpoint '" + path.string() + "' header";
}

void refuse_checkpoint(const std::filesystem::path& path, const std::string& why) {
  throw InputError("checkpoint '" + path.string() + "' " + why);
}

void write_checkpoint_file(const std::filesystem::path& path, std::string_view magic,
                           const CheckpointContent& content) {
  std::string bytes(magic);
  bytes += content.header.dump();
  bytes += '\n';
  bytes += content.numbers;
  Fnv1a hash;
  hash.add(bytes);
  const std::uint64_t value = hash.value();
  bytes += bytes_of(std::span<const std::uint64_t>(&value, 1));
  write_whole_file(path, bytes);
}

CheckpointContent read_checkpoint_file(const std::filesystem::path& path, std::string_view magic) {
  const std::string content = read_bytes(path);
  std::string_view rest = content;
  if (!rest.starts_with(magic)) refuse_checkpoint(path, "is not a checkpoint of this version");
  std::uint64_t stored = 0;
  if (rest.size() < magic.size() + sizeof(stored)) refuse_checkpoint(path, "is truncated");
  std::memcpy(&stored, rest.data() + rest.size() - sizeof(stored), sizeof(stored));
  rest.remove_suffix(sizeof(stored));
  Fnv1a hash;
  hash.add(rest);
  if (hash.value() != stored) {
    refuse_checkpoint(path, "is damaged: its check sum does not match");
  }
  rest.remove_prefix(magic.size());
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos) refuse_checkpoint(path, "has no header");
  return {parse_json(rest.substr(0, end), checkpoint_header_name(path)),
          std::string(rest.substr(end + 1))};
}

}  // namespace lensforge
