// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/picture_refusal.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::picture_refusal;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

enum Compression : std::uint32_t { kRgb, kRle8, kRle4, kBitFields, kAlphaBitFields = 6 };

/// Properties of a file, apart from its pixels.
struct Variant {
  std::uint32_t header = 40;
  int bits = 24;
  std::uint32_t compression = kRgb;
  std::array<std::uint32_t, 4> masks{};  ///< Red, green, blue, alpha; where they are stored.
  bool top_down = false;
  int colors = 0;  ///< Of the palette; 0: as many as the bits allow.

  [[nodiscard]] bool has_palette() const { return bits <= 8; }
};

/// Pixels row by row from the top: indices of a palette, or the bits of a pixel.
struct Pixels {
  int columns = 0;
  int rows = 0;
  std::vector<std::uint32_t> values;
  std::vector<std::array<int, 3>> palette;

  [[nodiscard]] std::uint32_t at(int column, int row) const {
    return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(column)];
  }
};

std::string little(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8U * unsigned(i)) & 0xFFU);
  return text;
}

/// The masks that hold: those of the file, or the usual ones.
std::array<std::uint32_t, 4> masks_of(const Variant& v) {
  if (v.compression != kRgb) return v.masks;
  if (v.bits == 16) return {0x7C00, 0x3E0, 0x1F, 0};
  return {0xFF0000, 0xFF00, 0xFF, 0};
}

Pixels random_pixels(const Variant& v, std::mt19937& random) {
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random()) % n; };
  Pixels pixels{static_cast<int>(1 + below(40)), static_cast<int>(1 + below(12)), {}, {}};
  const int colors = v.colors > 0 ? v.colors : 1 << std::min(v.bits, 8);
  for (int i = 0; v.has_palette() && i < colors; ++i) {
    const int grey = static_cast<int>(below(256));
    pixels.palette.push_back(below(2) == 0 ? std::array{grey, grey, grey}
                                           : std::array{grey, int(below(256)), int(below(256))});
  }
  std::uint32_t last = 0xFFFFFFFF;  // The first pixel is seen, whatever the masks.
  for (int i = 0; i < pixels.columns * pixels.rows; ++i) {
    if (i > 0 && below(3) == 0) last = static_cast<std::uint32_t>(random());
    pixels.values.push_back(v.has_palette() ? last % static_cast<std::uint32_t>(colors)
                            : v.bits == 32  ? last
                                            : last & ((1U << unsigned(v.bits)) - 1U));
  }
  return pixels;
}

/// One row without runs, filled up to four bytes.
std::string plain_row(const Variant& v, const Pixels& pixels, int row) {
  std::string bytes;
  std::uint32_t byte = 0;
  int filled = 0;
  for (int column = 0; column < pixels.columns; ++column) {
    const std::uint32_t value = pixels.at(column, row);
    if (!v.has_palette()) {
      bytes += little(value, v.bits / 8);
      continue;
    }
    byte = byte << unsigned(v.bits) | value;
    filled += v.bits;
    if (filled < 8) continue;
    bytes += static_cast<char>(byte);
    byte = 0;
    filled = 0;
  }
  if (filled > 0) bytes += static_cast<char>(byte << unsigned(8 - filled));
  return bytes + std::string((4 - bytes.size() % 4) % 4, '\0');
}

/// A writer of runs: counts that repeat a byte, pixels one by one, and gaps over colour 0.
class RunWriter {
 public:
  RunWriter(const Pixels& pixels, bool nibbles, std::mt19937& random)
      : pixels_(pixels), nibbles_(nibbles), random_(random) {}

  std::string row(int row) {
    bytes_.clear();
    for (int column = 0; column < pixels_.columns;) column += put(column, row);
    return bytes_ + std::string(2, '\0');
  }

 private:
  /// @return how many pixels were written.
  int put(int column, int row) {
    const int left = std::min(255, pixels_.columns - column);
    if (left >= 3 && random_() % 3 == 0)
      return put_each(column, row, 3 + int(random_() % unsigned(left - 2)));
    int zeros = 0;
    while (zeros < left && pixels_.at(column + zeros, row) == 0) ++zeros;
    if (zeros > 0 && random_() % 2 == 0) {
      bytes_ += {'\0', '\2', static_cast<char>(zeros), '\0'};
      return zeros;
    }
    const int period = nibbles_ ? 2 : 1;
    int count = std::min(period, left);
    while (count < left &&
           pixels_.at(column + count, row) == pixels_.at(column + count - period, row)) {
      ++count;
    }
    bytes_ += {static_cast<char>(count), packed(column, row, count)};
    return count;
  }

  int put_each(int column, int row, int count) {
    const std::size_t begin = bytes_.size();
    bytes_ += {'\0', static_cast<char>(count)};
    for (int i = 0; i < count; i += nibbles_ ? 2 : 1) bytes_ += packed(column + i, row, count - i);
    if ((bytes_.size() - begin) % 2 == 1) bytes_ += '\0';
    return count;
  }

  [[nodiscard]] char packed(int column, int row, int count) const {
    const std::uint32_t first = pixels_.at(column, row);
    if (!nibbles_) return static_cast<char>(first);
    return static_cast<char>(first << 4U | (count > 1 ? pixels_.at(column + 1, row) : 0U));
  }

  const Pixels& pixels_;
  bool nibbles_;
  std::mt19937& random_;
  std::string bytes_;
};

std::string pixel_bytes(const Variant& v, const Pixels& pixels, std::mt19937& random) {
  const bool runs = v.compression == kRle8 || v.compression == kRle4;
  RunWriter writer(pixels, v.compression == kRle4, random);
  std::string bytes;
  for (int i = 0; i < pixels.rows; ++i) {
    const int row = v.top_down ? i : pixels.rows - 1 - i;
    bytes += runs ? writer.row(row) : plain_row(v, pixels, row);
  }
  return runs ? bytes + std::string("\0\1", 2) : bytes;
}

/// The picture's header with the masks behind it.
std::string header_bytes(const Variant& v, const Pixels& pixels) {
  if (v.header == 12) {
    return little(12, 4) + little(std::uint64_t(pixels.columns), 2) +
           little(std::uint64_t(pixels.rows), 2) + little(1, 2) + little(std::uint64_t(v.bits), 2);
  }
  const int rows = v.top_down ? -pixels.rows : pixels.rows;
  std::string bytes = little(v.header, 4) + little(std::uint64_t(pixels.columns), 4) +
                      little(static_cast<std::uint32_t>(rows), 4) + little(1, 2) +
                      little(std::uint64_t(v.bits), 2) + little(v.compression, 4) + little(0, 4) +
                      little(2835, 4) + little(2835, 4) + little(std::uint64_t(v.colors), 4) +
                      little(0, 4);
  for (const std::uint32_t mask : v.masks) bytes += little(mask, 4);
  std::size_t size = v.header;
  if (v.header == 40 && v.compression == kBitFields) size = 52;
  if (v.header == 40 && v.compression == kAlphaBitFields) size = 56;
  bytes.resize(size, '\0');
  return bytes;
}

std::string bmp_bytes(const Variant& v, const Pixels& pixels, std::mt19937& random) {
  std::string head = header_bytes(v, pixels);
  for (const auto& [red, green, blue] : pixels.palette) {
    head += {static_cast<char>(blue), static_cast<char>(green), static_cast<char>(red)};
    if (v.header > 12) head += '\0';
  }
  const std::string data = pixel_bytes(v, pixels, random);
  const std::size_t at = 14 + head.size();
  return "BM" + little(at + data.size(), 4) + little(0, 4) + little(at, 4) + head + data;
}

double share(std::uint32_t value, std::uint32_t mask) {
  if (mask == 0) return 0.0;
  const auto shift = static_cast<unsigned>(std::countr_zero(mask));
  return double(std::uint64_t{value & mask} >> shift) / double(mask >> shift);
}

double expected_light(const Variant& v, const Pixels& pixels, int column, int row) {
  const std::uint32_t value = pixels.at(column, row);
  std::array<double, 3> light{};
  double alpha = 1.0;
  for (std::size_t c = 0; c < 3; ++c) {
    light[c] =
        decode(v.has_palette() ? pixels.palette[value][c] / 255.0 : share(value, masks_of(v)[c]));
  }
  const bool stored = v.header >= 56 || (v.header == 40 && v.compression == kAlphaBitFields);
  const std::uint32_t mask = masks_of(v)[3];
  if (!v.has_palette() && stored && mask != 0) alpha = share(value, mask);
  return alpha * luminance_rec709(light);
}

std::vector<Variant> all_variants() {
  std::vector<Variant> variants;
  for (const bool top_down : {false, true}) {
    for (const std::uint32_t header : {12U, 40U, 52U, 56U, 64U, 108U, 124U}) {
      if (header == 12 && top_down) continue;
      for (const int bits : {1, 4, 8, 16, 24, 32}) {
        if (header == 12 && (bits == 16 || bits == 32)) continue;
        variants.push_back({header, bits, kRgb, {}, top_down, 0});
      }
      if (header == 12) continue;
      variants.push_back({header, 8, kRle8, {}, top_down, 0});
      variants.push_back({header, 4, kRle4, {}, top_down, 0});
      variants.push_back({header, 8, kRgb, {}, top_down, 37});
      if (header == 64) continue;
      for (const std::uint32_t compression : {kBitFields, kAlphaBitFields}) {
        variants.push_back({header, 16, compression, {0xF800, 0x7E0, 0x1F, 0}, top_down, 0});
        variants.push_back({header, 16, compression, {0xF00, 0xF0, 0xF, 0xF000}, top_down, 0});
        variants.push_back(
            {header, 32, compression, {0xFF000000, 0xFF0000, 0xFF00, 0xFF}, top_down, 0});
        variants.push_back(
            {header, 32, compression, {0xFF, 0xFF00, 0xFF0000, 0xFF000000}, top_down, 0});
        variants.push_back(
            {header, 32, compression, {0x3FF, 0xFFC00, 0x3FF00000, 0xC0000000}, top_down, 0});
      }
    }
  }
  return variants;
}

std::string words(const Variant& v) {
  return "header " + std::to_string(v.header) + ", bits " + std::to_string(v.bits) +
         ", compression " + std::to_string(v.compression) + (v.top_down ? ", top down" : "");
}

TEST(BmpInput, EveryHeaderDepthMaskAndRunIsReadAsItWasWritten) {
  const TempFolder folder;
  std::mt19937 random(3);
  for (const Variant& variant : all_variants()) {
    const Pixels pixels = random_pixels(variant, random);
    write_bytes(folder / "a.bmp", bmp_bytes(variant, pixels, random));
    const Image image = read_image(folder / "a.bmp").image;
    ASSERT_EQ(image.columns(), pixels.columns) << words(variant);
    ASSERT_EQ(image.rows(), pixels.rows) << words(variant);
    double most = 0.0;
    for (int i = 0; i < pixels.columns * pixels.rows; ++i) {
      const int column = i % pixels.columns;
      const int row = i / pixels.columns;
      const double expected = expected_light(variant, pixels, column, row);
      most = std::max(most, std::abs(image.at(column, row) - expected));
    }
    // What is no byte goes through a table of 16 bits.
    EXPECT_LT(most, 2e-5) << words(variant);
  }
}

/// A variant that is read, with its bytes; half of all, as each read starts a process.
struct Sample {
  Variant variant;
  std::string bytes;
};

std::vector<Sample> samples(std::mt19937& random) {
  std::vector<Sample> all;
  for (const Variant& variant : all_variants()) {
    if (random() % 2 == 0) continue;
    const Pixels pixels = random_pixels(variant, random);
    all.push_back({variant, bmp_bytes(variant, pixels, random)});
  }
  return all;
}

TEST(BmpInput, ATruncatedPictureIsRefusedWhereverItEnds) {
  const TempFolder folder;
  std::mt19937 random(5);
  for (const Sample& sample : samples(random)) {
    // Behind the last pixel come three bytes at most that fill a row up, or the marks of its end.
    const std::size_t end = sample.bytes.size() - 6;
    for (const std::size_t cut : {30 + random() % (end - 30), end}) {
      write_bytes(folder / "a.bmp", std::string_view(sample.bytes).substr(0, cut));
      EXPECT_THAT(picture_refusal(folder / "a.bmp"),
                  AnyOf(HasSubstr("BMP data end"), HasSubstr("no size")))
          << words(sample.variant) << " cut to " << cut;
    }
  }
}

TEST(BmpInput, NoChangeOfBytesCrashesIt) {
  const TempFolder folder;
  std::mt19937 random(7);
  for (Sample& sample : samples(random)) {
    for (int i = 0; i < 3; ++i) {
      const std::size_t at = random() % std::min<std::size_t>(sample.bytes.size(), 140);
      sample.bytes[at] = static_cast<char>(random() % 3 == 0 ? 0xFF : random());
    }
    write_bytes(folder / "a.bmp", sample.bytes);
    try {
      EXPECT_FALSE(read_image(folder / "a.bmp").image.empty());
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), Not(AnyOf(HasSubstr("crashed"), HasSubstr("without a result"))));
    }
  }
}

Pixels four_pixels(std::uint32_t value) { return {2, 2, std::vector<std::uint32_t>(4, value), {}}; }

std::string refusal_of(const std::string& bytes) {
  const TempFolder folder;
  write_bytes(folder / "a.bmp", bytes);
  return picture_refusal(folder / "a.bmp");
}

TEST(BmpInput, ASolidPictureWithoutMasksHasNoAlpha) {
  const TempFolder folder;
  std::mt19937 random(1);
  write_bytes(folder / "a.bmp",
              bmp_bytes({40, 32, kRgb, {}, false, 0}, four_pixels(0x00FFFFFF), random));
  const LoadedImage loaded = read_image(folder / "a.bmp");
  EXPECT_EQ(loaded.image.at(0, 0), 1.0F);
  EXPECT_THAT(loaded.changes, IsEmpty());
}

TEST(BmpInput, WhatMasksCannotSayIsRefused) {
  std::mt19937 random(1);
  const auto with = [&](std::array<std::uint32_t, 4> masks, int bits) {
    return refusal_of(bmp_bytes({56, bits, kBitFields, masks, false, 0}, four_pixels(7), random));
  };
  EXPECT_THAT(with({0xF00F, 0xF0, 0xF00, 0}, 32), HasSubstr("masks have gaps"));
  EXPECT_THAT(with({0, 0, 0, 0xFF}, 32), HasSubstr("masks leave no colour"));
  EXPECT_THAT(with({0xFF0000, 0xFF00, 0xFF, 0}, 16), HasSubstr("reach beyond the pixel"));
}

TEST(BmpInput, WhatIsInAnotherFormatOrUnknownIsRefusedWithItsNumber) {
  std::mt19937 random(1);
  const Pixels pixels = four_pixels(7);
  const auto with = [&](const Variant& v) { return refusal_of(bmp_bytes(v, pixels, random)); };
  EXPECT_THAT(with({40, 24, 4, {}, false, 0}), HasSubstr("JPEG or PNG"));
  EXPECT_THAT(with({40, 24, 9, {}, false, 0}), HasSubstr("compression 9"));
  EXPECT_THAT(with({64, 24, 4, {}, false, 0}), HasSubstr("JPEG or PNG"));
  EXPECT_THAT(with({40, 24, kRle8, {}, false, 0}), HasSubstr("no 24 bits"));
}

TEST(BmpInput, RunsThatLeaveThePictureAreRefused) {
  std::mt19937 random(1);
  Pixels pixels = four_pixels(0);
  pixels.palette.assign(256, {9, 9, 9});
  const std::string head =
      bmp_bytes({40, 8, kRle8, {}, false, 0}, pixels, random).substr(0, 14 + 40 + 1024);
  for (const std::string_view runs :
       {std::string_view("\3\1\0\1", 4), std::string_view("\0\3\1\1\1\0", 6),
        std::string_view("\0\2\3\0\0\1", 6), std::string_view("\0\0\0\0\1\1\0\1", 8)}) {
    EXPECT_THAT(refusal_of(head + std::string(runs)), HasSubstr("runs leave the picture"));
  }
}

TEST(BmpInput, AColourBeyondThePaletteIsRefused) {
  std::mt19937 random(1);
  Pixels pixels = four_pixels(9);
  pixels.palette.assign(4, {9, 9, 9});
  EXPECT_THAT(refusal_of(bmp_bytes({40, 8, kRgb, {}, false, 4}, pixels, random)),
              HasSubstr("colour 9 of a palette of 4"));
}

}  // namespace
}  // namespace lensforge
