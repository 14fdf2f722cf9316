// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/png_outline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

// As OpenImageIO configures it, libpng accepts truncated files. So it only gets whole files,
// without chunks that do not matter here. Layout and CRC: W3C PNG specification, 5.3 and 5.5.
namespace lensforge {
namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::uint32_t kLongestChunk = 0x7fffffff;
constexpr std::array<std::string_view, 10> kEssential{"IHDR", "PLTE", "IDAT", "IEND", "tRNS",
                                                      "gAMA", "cHRM", "sRGB", "iCCP", "eXIf"};

constexpr std::array<std::uint32_t, 256> make_crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t n = 0; n < table.size(); ++n) {
    std::uint32_t c = n;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1U) : c >> 1U;
    table[n] = c;
  }
  return table;
}
constexpr std::array<std::uint32_t, 256> kCrcTable = make_crc_table();

std::uint32_t crc(std::string_view bytes) {
  std::uint32_t c = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    c = kCrcTable[(c ^ static_cast<unsigned char>(byte)) & 0xFFU] ^ (c >> 8U);
  }
  return c ^ 0xFFFFFFFFU;
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(0, 4)) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

/// Appends up to `count` bytes in steps, so that a corrupt length does not allocate more than the
/// file holds.
bool append_bytes(std::istream& file, std::size_t count, std::string& bytes) {
  constexpr std::size_t kStep = std::size_t{1} << 20;
  while (count > 0) {
    const std::size_t step = std::min(count, kStep);
    const std::size_t old_size = bytes.size();
    bytes.resize(old_size + step);
    if (!file.read(&bytes[old_size], static_cast<std::streamsize>(step))) return false;
    count -= step;
  }
  return true;
}

/// One chunk: length, type, data, CRC.
struct Chunk {
  std::string bytes;
  [[nodiscard]] std::string_view type() const { return std::string_view(bytes).substr(4, 4); }
  [[nodiscard]] std::string_view data() const {
    return std::string_view(bytes).substr(8, bytes.size() - 12);
  }
  [[nodiscard]] bool intact() const {
    const std::string_view all(bytes);
    return crc(all.substr(4, all.size() - 8)) == big_endian(all.substr(all.size() - 4));
  }
};

std::optional<Chunk> read_chunk(std::istream& file) {
  Chunk chunk;
  if (!append_bytes(file, 8, chunk.bytes)) return std::nullopt;
  const std::uint32_t length = big_endian(chunk.bytes);
  if (length > kLongestChunk || !append_bytes(file, length + 4, chunk.bytes)) return std::nullopt;
  return chunk;
}

bool read_signature(std::istream& file) {
  std::string signature;
  return append_bytes(file, kSignature.size(), signature) && signature == kSignature;
}

}  // namespace

std::optional<PngSize> read_png_size(std::istream& file) {
  std::string head;
  if (!read_signature(file)) return std::nullopt;
  if (!append_bytes(file, 16, head)) return PngSize{};
  return PngSize{big_endian(std::string_view(head).substr(8)),
                 big_endian(std::string_view(head).substr(12))};
}

EssentialPng read_essential_png(std::istream& file) {
  EssentialPng png;
  if (!read_signature(file)) return {{}, "is no PNG file", {}, false};
  png.bytes = kSignature;
  for (;;) {
    const std::optional<Chunk> chunk = read_chunk(file);
    if (!chunk) return {{}, "is truncated: the PNG data end before their end chunk", {}, false};
    const std::string_view type = chunk->type();
    if (!chunk->intact()) {
      return {{}, "is corrupt: a PNG chunk's checksum is wrong", {}, false};
    }
    if (type == "acTL") png.animated = true;
    if (type == "iCCP") png.color_profile = chunk->data().substr(0, chunk->data().find('\0'));
    if (std::find(kEssential.begin(), kEssential.end(), type) != kEssential.end()) {
      png.bytes += chunk->bytes;
    }
    if (type == "IEND") return png;
  }
}

}  // namespace lensforge
