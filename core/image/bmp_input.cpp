// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <istream>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/picture_codec.h"

namespace lensforge {
namespace {

/// Reason for refusing a BMP picture, worded as the end of a sentence.
class BmpProblem : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The bits of a pixel that hold one channel.
struct BmpMask {
  unsigned shift = 0;
  unsigned bits = 0;  ///< 0: no such channel.

  /// @throw BmpProblem if the bits are not side by side.
  static BmpMask of(std::uint32_t mask);
  [[nodiscard]] std::uint32_t value(std::uint32_t pixel) const {
    return static_cast<std::uint32_t>(std::uint64_t{pixel} >> shift & highest());
  }
  [[nodiscard]] std::uint64_t highest() const { return (std::uint64_t{1} << bits) - 1; }
};

enum class BmpPacking { kNone, kRunsOfBytes, kRunsOfNibbles };

/// Everything before the pixels of a BMP picture.
struct BmpHeader {
  int columns = 0;
  int rows = 0;
  bool top_down = false;
  int bits = 0;  ///< Per pixel: 1, 4, 8 with a palette; 16, 24, 32 with masks.
  BmpPacking packing = BmpPacking::kNone;
  std::vector<std::array<std::uint8_t, 3>> palette;  ///< Red, green, blue.
  std::array<BmpMask, 4> masks;                      ///< Red, green, blue, alpha.
  std::string profile;                               ///< ICC, embedded; empty without one.
  std::uint64_t pixels_at = 0;                       ///< Offset in the file.
};

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
constexpr std::uint32_t kMaxProfileBytes = 1U << 24U;

enum Compression : std::uint32_t {
  kRgb = 0,
  kRle8 = 1,
  kRle4 = 2,
  kBitFields = 3,
  kJpeg = 4,
  kPng = 5,
  kAlphaBitFields = 6,
};

constexpr const char* kHeaderTruncated = "its BMP data end within the header";

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
          "it holds a JPEG or PNG picture: save it in that format");
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
  require(static_cast<bool>(file), kHeaderTruncated);
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
  require(size <= kMaxProfileBytes, "its colour profile has " + std::to_string(size) + " bytes");
  return read_at(file, kFileHeader + std::uint64_t{bytes.number(kFileHeader + 112)}, size);
}

BmpMask BmpMask::of(std::uint32_t mask) {
  if (mask == 0) return {};
  const BmpMask result{static_cast<unsigned>(std::countr_zero(mask)),
                       static_cast<unsigned>(std::popcount(mask))};
  require(mask == result.highest() << result.shift, "its BMP masks have gaps");
  return result;
}

/// Reads BITMAPCOREHEADER, BITMAPINFOHEADER with and without masks, BITMAPV4HEADER,
/// BITMAPV5HEADER and OS/2's longer one (Microsoft, "Bitmap Header Types").
/// @throw BmpProblem
BmpHeader read_bmp_header(std::istream& file) {
  const FirstBytes bytes(file);
  const std::uint32_t header = bytes.number(kFileHeader);
  require(std::find(kHeaders.begin(), kHeaders.end(), header) != kHeaders.end(),
          "a BMP header of " + std::to_string(header) + " bytes is not known");
  require(bytes.count() >= kFileHeader + header, kHeaderTruncated);
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

constexpr const char* kPixelsTruncated = "its BMP data end before its pixels";

// Runs: Microsoft, "Bitmap Compression".

/// Unpacks runs into palette indices, row by row in the order of the file. Skipped pixels keep the
/// palette's first colour.
class RunDecoder {
 public:
  RunDecoder(const BmpHeader& bmp, std::string_view packed)
      : columns_(static_cast<std::size_t>(bmp.columns)),
        rows_(static_cast<std::size_t>(bmp.rows)),
        nibbles_(bmp.packing == BmpPacking::kRunsOfNibbles),
        packed_(packed),
        indices_(columns_ * rows_) {}

  std::vector<std::uint8_t> decode() && {
    while (!done_ && !(packed_.empty() && all_rows_are_there())) step();
    return std::move(indices_);
  }

 private:
  [[nodiscard]] bool all_rows_are_there() const {
    return row_ >= rows_ || (row_ + 1 == rows_ && column_ == columns_);
  }

  std::uint8_t next() {
    if (packed_.empty()) throw BmpProblem(kPixelsTruncated);
    const auto byte = static_cast<std::uint8_t>(packed_.front());
    packed_.remove_prefix(1);
    return byte;
  }

  void step() {
    const std::size_t count = next();
    const std::uint8_t what = next();
    if (count > 0) return put_run(count, what);
    if (what == 0) return end_row();
    if (what == 1) {
      done_ = true;
    } else if (what == 2) {
      skip();
    } else {
      put_each(what);
    }
  }

  void end_row() {
    column_ = 0;
    ++row_;
  }

  void skip() {
    column_ += next();
    row_ += next();
    if (column_ > columns_ || row_ > rows_) leave_picture();
  }

  void put_run(std::size_t count, std::uint8_t what) {
    require_room(count);
    for (std::size_t i = 0; i < count; ++i) put(nibbles_ ? half(what, i) : what);
  }

  /// `count` indices one after another; they fill an even number of bytes.
  void put_each(std::size_t count) {
    require_room(count);
    const std::size_t bytes = nibbles_ ? (count + 1) / 2 : count;
    std::uint8_t byte = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!nibbles_ || i % 2 == 0) byte = next();
      put(nibbles_ ? half(byte, i) : byte);
    }
    if (bytes % 2 == 1) next();
  }

  static std::uint8_t half(std::uint8_t byte, std::size_t i) {
    return i % 2 == 0 ? byte >> 4U : byte & 15U;
  }

  void put(std::uint8_t index) { indices_[row_ * columns_ + column_++] = index; }

  void require_room(std::size_t count) const {
    if (row_ >= rows_ || count > columns_ - column_) leave_picture();
  }
  [[noreturn]] static void leave_picture() { throw BmpProblem("its BMP runs leave the picture"); }

  std::size_t columns_;
  std::size_t rows_;
  bool nibbles_;
  std::string_view packed_;
  std::vector<std::uint8_t> indices_;
  std::size_t column_ = 0;
  std::size_t row_ = 0;
  bool done_ = false;
};

class BmpInput final : public OIIO::ImageInput {
 public:
  [[nodiscard]] const char* format_name() const override { return "bmp"; }

  bool open(const std::string& name, OIIO::ImageSpec& spec) override {
    return guarded([&] {
      file_.open(name, std::ios::binary);
      bmp_ = read_bmp_header(file_);
      m_spec = spec_of(bmp_);
      spec = m_spec;
      require_pixels();
    });
  }

  bool close() override {
    file_.close();
    return true;
  }

  bool read_native_scanline(int /*subimage*/, int /*miplevel*/, int y, int /*z*/,
                            void* data) override {
    return guarded([&] {
      const auto row = static_cast<std::size_t>(bmp_.top_down ? y : bmp_.rows - 1 - y);
      if (bmp_.bits > 8) {
        put_masked(row, data);
      } else {
        put_palette(row, static_cast<std::uint8_t*>(data));
      }
    });
  }

 private:
  template <class Call>
  bool guarded(const Call& call) {
    try {
      call();
      return true;
    } catch (const BmpProblem& problem) {
      errorfmt("{}", problem.what());
      return false;
    }
  }

  /// True if all masks have eight bits, which give bytes; others are scaled to sixteen.
  static bool has_bytes(const BmpHeader& bmp) {
    return std::all_of(bmp.masks.begin(), bmp.masks.end(),
                       [](const BmpMask& mask) { return mask.bits == 0 || mask.bits == 8; });
  }

  static OIIO::ImageSpec spec_of(const BmpHeader& bmp) {
    const bool alpha = bmp.masks[3].bits > 0;
    OIIO::ImageSpec spec(bmp.columns, bmp.rows, alpha ? 4 : 3,
                         has_bytes(bmp) ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    if (!bmp.profile.empty()) {
      spec.attribute("ICCProfile",
                     OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(bmp.profile.size())),
                     bmp.profile.data());
    }
    return spec;
  }

  /// Bytes of a row, and of a row padded to a multiple of four.
  [[nodiscard]] std::size_t row_bytes() const {
    return (static_cast<std::size_t>(bmp_.columns) * static_cast<std::size_t>(bmp_.bits) + 7) / 8;
  }
  [[nodiscard]] std::size_t stride() const { return (row_bytes() + 3) / 4 * 4; }

  /// Unpacks runs, which have no place for a row of its own.
  void require_pixels() {
    file_.seekg(0, std::ios::end);
    const auto size = static_cast<std::uint64_t>(file_.tellg());
    if (bmp_.packing == BmpPacking::kNone) {
      const std::uint64_t last = stride() * (static_cast<std::size_t>(bmp_.rows) - 1);
      if (size < bmp_.pixels_at + last + row_bytes()) throw BmpProblem(kPixelsTruncated);
      return;
    }
    if (size < bmp_.pixels_at) throw BmpProblem(kPixelsTruncated);
    std::string packed(size - bmp_.pixels_at, '\0');
    file_.seekg(static_cast<std::streamoff>(bmp_.pixels_at));
    file_.read(packed.data(), static_cast<std::streamsize>(packed.size()));
    indices_ = RunDecoder(bmp_, packed).decode();
  }

  const std::string& stored_row(std::size_t row) {
    row_.resize(row_bytes());
    file_.seekg(static_cast<std::streamoff>(bmp_.pixels_at + row * stride()));
    file_.read(row_.data(), static_cast<std::streamsize>(row_.size()));
    if (!file_) throw BmpProblem(kPixelsTruncated);
    return row_;
  }

  void put_palette(std::size_t row, std::uint8_t* data) {
    const auto columns = static_cast<std::size_t>(bmp_.columns);
    const bool packed = bmp_.packing != BmpPacking::kNone;
    const std::string& bytes = packed ? row_ : stored_row(row);
    const auto bits = static_cast<std::size_t>(bmp_.bits);
    for (std::size_t column = 0; column < columns; ++column) {
      std::size_t index = 0;
      if (packed) {
        index = indices_[row * columns + column];
      } else {
        const std::size_t bit = column * bits;
        const auto byte = static_cast<unsigned char>(bytes[bit / 8]);
        index = byte >> (8 - bits - bit % 8) & ((1U << bits) - 1U);
      }
      if (index >= bmp_.palette.size()) {
        throw BmpProblem("a pixel has colour " + std::to_string(index) + " of a palette of " +
                         std::to_string(bmp_.palette.size()));
      }
      std::memcpy(data + 3 * column, bmp_.palette[index].data(), 3);
    }
  }

  void put_masked(std::size_t row, void* data) {
    if (m_spec.format == OIIO::TypeDesc::UINT8) {
      put_channels(stored_row(row), static_cast<std::uint8_t*>(data));
    } else {
      put_channels(stored_row(row), static_cast<std::uint16_t*>(data));
    }
  }

  template <class Value>
  void put_channels(const std::string& bytes, Value* data) const {
    constexpr std::uint64_t kWhite = std::numeric_limits<Value>::max();
    const auto size = static_cast<std::size_t>(bmp_.bits / 8);
    const auto channels = static_cast<std::size_t>(m_spec.nchannels);
    for (std::size_t at = 0; at < bytes.size(); at += size) {
      std::uint32_t pixel = 0;
      for (std::size_t i = size; i-- > 0;) {
        pixel = pixel << 8U | static_cast<unsigned char>(bytes[at + i]);
      }
      for (std::size_t c = 0; c < channels; ++c) {
        const BmpMask& mask = bmp_.masks[c];
        const std::uint64_t most = mask.highest();
        const std::uint64_t scaled = kWhite * mask.value(pixel) + most / 2;
        *data++ = static_cast<Value>(most == 0 ? 0 : scaled / most);
      }
    }
  }

  std::ifstream file_;
  BmpHeader bmp_;
  std::vector<std::uint8_t> indices_;  ///< Unpacked runs, in the order of the file.
  std::string row_;                    ///< Bytes of the row.
};

}  // namespace

std::unique_ptr<OIIO::ImageInput> make_bmp_input() { return std::make_unique<BmpInput>(); }

}  // namespace lensforge
