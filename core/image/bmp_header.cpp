// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/bmp_header.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdlib>

namespace lensforge {
namespace {

/// Bytes of the file header and of the longest picture header after it.
constexpr std::size_t kFileHeader = 14;
constexpr std::size_t kLongestHeader = 124;
constexpr std::uint32_t kCoreHeader = 12;
constexpr std::uint32_t kOs2Header = 64;
constexpr std::array<std::uint32_t, 8> kHeaders{kCoreHeader, 16,         40,  52,
                                                56,          kOs2Header, 108, kLongestHeader};

/// Offset of the masks: inside longer headers, or directly after BITMAPINFOHEADER.
constexpr std::size_t kMasks = 54;

/// Maximum size of a profile; printer profiles have 3 MB.
constexpr std::uint32_t kMostProfileBytes = 1U << 24U;

enum Compression : std::uint32_t {
  kRgb = 0,
  kRle8 = 1,
  kRle4 = 2,
  kBitFields = 3,
  kJpeg = 4,
  kPng = 5,
  kAlphaBitFields = 6,
};

constexpr const char* kTruncated = "its BMP data end within the header";

/// The first bytes of the file; 0 beyond its end.
class FirstBytes {
 public:
  explicit FirstBytes(std::istream& file) {
    file.clear();
    file.seekg(0);
    file.read(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
    count_ = static_cast<std::size_t>(file.gcount());
    file.clear();
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::uint32_t number(std::size_t at, std::size_t bytes = 4) const {
    std::uint32_t value = 0;
    for (std::size_t i = bytes; i-- > 0;) {
      value = value << 8U | static_cast<unsigned char>(bytes_[at + i]);
    }
    return value;
  }

 private:
  std::array<char, kFileHeader + kLongestHeader> bytes_{};
  std::size_t count_ = 0;
};

void require(bool holds, const std::string& problem) {
  if (!holds) throw BmpProblem(problem);
}

/// True if the compression is valid with so many bits per pixel.
bool fit(std::uint32_t compression, int bits) {
  switch (compression) {
    case kRgb:
      return bits == 1 || bits == 4 || bits == 8 || bits == 16 || bits == 24 || bits == 32;
    case kRle8:
      return bits == 8;
    case kRle4:
      return bits == 4;
    default:
      return bits == 16 || bits == 32;
  }
}

void require_compression(std::uint32_t compression, std::uint32_t header, int bits) {
  require(compression != kJpeg && compression != kPng,
          "it holds a JPEG or PNG picture; saved as that it would do");
  const bool known = compression <= kBitFields || compression == kAlphaBitFields;
  require(known && !(header == kOs2Header && compression > kRle4),
          "its BMP compression " + std::to_string(compression) + " is not known");
  require(fit(compression, bits), "a BMP picture of compression " + std::to_string(compression) +
                                      " has no " + std::to_string(bits) + " bits a pixel");
}

/// Default masks for a file without masks.
std::array<std::uint32_t, 4> usual_masks(int bits) {
  if (bits == 16) return {0x7C00, 0x03E0, 0x001F, 0};
  return {0xFF0000, 0x00FF00, 0x0000FF, 0};
}

std::array<BmpMask, 4> read_masks(const FirstBytes& bytes, std::uint32_t header, int bits,
                                  std::uint32_t compression) {
  std::array<std::uint32_t, 4> masks = usual_masks(bits);
  if (compression != kRgb) {
    const bool alpha = header >= 56 || (header == 40 && compression == kAlphaBitFields);
    for (std::size_t i = 0; i < 3 + std::size_t{alpha}; ++i) {
      masks[i] = bytes.number(kMasks + 4 * i);
    }
    const std::uint32_t outside = bits == 16 ? 0xFFFF0000U : 0U;
    require((masks[0] | masks[1] | masks[2]) != 0, "its BMP masks leave no colour");
    for (const std::uint32_t mask : masks) {
      require((mask & outside) == 0, "its BMP masks reach beyond the pixel");
    }
  }
  std::array<BmpMask, 4> result;
  std::transform(masks.begin(), masks.end(), result.begin(), BmpMask::of);
  return result;
}

/// Reads `count` bytes at an offset. @throw BmpProblem if the file has fewer.
std::string read_at(std::istream& file, std::uint64_t place, std::size_t count) {
  std::string bytes(count, '\0');
  file.seekg(static_cast<std::streamoff>(place));
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  require(static_cast<bool>(file), kTruncated);
  return bytes;
}

/// @param entry  bytes per colour: blue, green, red and possibly one more.
std::vector<std::array<std::uint8_t, 3>> palette_of(const std::string& bytes, std::size_t entry) {
  std::vector<std::array<std::uint8_t, 3>> palette;
  for (std::size_t at = 0; at + entry <= bytes.size(); at += entry) {
    const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes[at + i]); };
    palette.push_back({byte(2), byte(1), byte(0)});
  }
  return palette;
}

/// Reads the palette and the offset of the pixels.
void read_colors(std::istream& file, const FirstBytes& bytes, std::uint32_t compression,
                 BmpHeader& bmp) {
  const std::uint32_t header = bytes.number(kFileHeader);
  std::uint64_t at = kFileHeader + header;
  if (header == 40 && compression == kBitFields) at += 12;
  if (header == 40 && compression == kAlphaBitFields) at += 16;
  const std::uint64_t pixels = bytes.number(10);
  require(pixels == 0 || pixels >= at, "its BMP pixels begin within the header");
  if (bmp.bits > 8) {
    bmp.pixels_at = std::max(pixels, at);
    return;
  }
  const std::size_t entry = header == kCoreHeader ? 3 : 4;
  const std::uint64_t used = header >= 40 ? bytes.number(46) : 0;
  const std::uint64_t most = std::uint64_t{1} << static_cast<unsigned>(bmp.bits);
  std::uint64_t colors = used == 0 ? most : std::min(used, most);
  if (pixels > 0) colors = std::min(colors, (pixels - at) / entry);
  bmp.palette = palette_of(read_at(file, at, entry * colors), entry);
  bmp.pixels_at = std::max(pixels, at + entry * colors);
}

/// The profile referred to by BITMAPV5HEADER.
std::string profile_of(std::istream& file, const FirstBytes& bytes) {
  constexpr std::uint32_t kEmbedded = 0x4D424544;  // 'MBED'
  if (bytes.number(kFileHeader) < kLongestHeader) return {};
  if (bytes.number(kFileHeader + 56) != kEmbedded) return {};
  const std::uint32_t size = bytes.number(kFileHeader + 116);
  require(size <= kMostProfileBytes, "its colour profile has " + std::to_string(size) + " bytes");
  return read_at(file, kFileHeader + std::uint64_t{bytes.number(kFileHeader + 112)}, size);
}

}  // namespace

BmpMask BmpMask::of(std::uint32_t mask) {
  if (mask == 0) return {};
  const BmpMask result{static_cast<unsigned>(std::countr_zero(mask)),
                       static_cast<unsigned>(std::popcount(mask))};
  require(mask == result.highest() << result.shift, "its BMP masks have gaps");
  return result;
}

BmpHeader read_bmp_header(std::istream& file) {
  const FirstBytes bytes(file);
  const std::uint32_t header = bytes.number(kFileHeader);
  require(std::find(kHeaders.begin(), kHeaders.end(), header) != kHeaders.end(),
          "a BMP header of " + std::to_string(header) + " bytes is not known");
  require(bytes.count() >= kFileHeader + header, kTruncated);
  BmpHeader bmp;
  if (header == kCoreHeader) {
    bmp.columns = static_cast<int>(bytes.number(18, 2));
    bmp.rows = static_cast<int>(bytes.number(20, 2));
    bmp.bits = static_cast<int>(bytes.number(24, 2));
  } else {
    const auto rows = static_cast<std::int32_t>(bytes.number(22));
    bmp.columns = static_cast<std::int32_t>(bytes.number(18));
    bmp.top_down = rows < 0;
    bmp.rows = std::abs(rows);
    bmp.bits = static_cast<int>(bytes.number(28, 2));
  }
  const std::uint32_t compression = header >= 40 ? bytes.number(30) : 0;
  require_compression(compression, header, bmp.bits);
  if (compression == kRle8) bmp.packing = BmpPacking::kRunsOfBytes;
  if (compression == kRle4) bmp.packing = BmpPacking::kRunsOfNibbles;
  if (bmp.bits > 8) bmp.masks = read_masks(bytes, header, bmp.bits, compression);
  read_colors(file, bytes, compression, bmp);
  bmp.profile = profile_of(file, bytes);
  return bmp;
}

}  // namespace lensforge
