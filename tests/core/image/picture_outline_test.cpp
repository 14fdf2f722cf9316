// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_outline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "core/sample_files.h"

namespace lensforge {
namespace {

std::optional<JpegOutline> outline_of(std::string_view bytes) {
  std::istringstream file{std::string(bytes)};
  return read_jpeg_outline(file);
}

TEST(JpegOutline, FindsSizeAndEnd) {
  const auto outline = outline_of(testing::view(testing::kCmykJpeg));
  ASSERT_TRUE(outline.has_value());
  EXPECT_EQ(outline->columns, 8);
  EXPECT_EQ(outline->rows, 8);
  EXPECT_TRUE(outline->complete);
}

TEST(JpegOutline, ACutStreamIsNotComplete) {
  const std::string_view bytes = testing::view(testing::kCmykJpeg);
  for (std::size_t cut = 2; cut < bytes.size(); ++cut) {
    const auto outline = outline_of(bytes.substr(0, cut));
    ASSERT_TRUE(outline.has_value());
    EXPECT_FALSE(outline->complete) << cut;
  }
}

TEST(JpegOutline, BytesBehindTheEndDoNotMatter) {
  EXPECT_TRUE(outline_of(std::string(testing::view(testing::kCmykJpeg)) + "more")->complete);
}

TEST(JpegOutline, AnEndMarkerInsideASegmentIsNotTheEnd) {
  // SOI, a comment that holds FF D9 (as a thumbnail does), and nothing more.
  EXPECT_FALSE(outline_of("\xff\xd8\xff\xfe\x00\x04\xff\xd9")->complete);
  EXPECT_FALSE(outline_of(std::string_view("\xff\xd8\xff\xfe\0\x04\xff\xd9", 8))->complete);
}

TEST(JpegOutline, OtherStreamsAreNoJpeg) {
  EXPECT_FALSE(outline_of("").has_value());
  EXPECT_FALSE(outline_of("\xff").has_value());
  EXPECT_FALSE(outline_of(testing::view(testing::kPalettePng)).has_value());
}

std::istringstream stream(std::string_view bytes) { return std::istringstream(std::string(bytes)); }

TEST(PngOutline, FindsTheSize) {
  auto file = stream(testing::view(testing::kHugePng));
  const auto size = read_png_size(file);
  ASSERT_TRUE(size.has_value());
  EXPECT_EQ(size->columns, 30'000U);
  EXPECT_EQ(size->rows, 30'000U);
}

TEST(PngOutline, OtherStreamsAreNoPng) {
  auto jpeg = stream(testing::view(testing::kCmykJpeg));
  EXPECT_FALSE(read_png_size(jpeg).has_value());
  auto empty = stream("");
  EXPECT_FALSE(read_png_size(empty).has_value());
}

TEST(PngOutline, ChunksThatThePictureDependsOnAreKept) {
  const std::string_view bytes = testing::view(testing::kPalettePng);
  auto file = stream(bytes);
  EXPECT_EQ(read_essential_png(file).bytes, bytes);
}

TEST(PngOutline, AColourProfileIsNamedAndKept) {
  auto file = stream(testing::view(testing::kProfilePng));
  const EssentialPng png = read_essential_png(file);
  EXPECT_EQ(png.color_profile, "Wide");
  EXPECT_NE(png.bytes.find("iCCP"), std::string::npos);
  EXPECT_EQ(png.problem, "");
}

TEST(PngOutline, EveryCutIsTruncated) {
  const std::string_view bytes = testing::view(testing::kPalettePng);
  for (std::size_t cut = 8; cut < bytes.size(); ++cut) {
    auto file = stream(bytes.substr(0, cut));
    EXPECT_THAT(read_essential_png(file).problem, ::testing::HasSubstr("is truncated")) << cut;
  }
}

TEST(PngOutline, EveryChangedByteIsNoticed) {
  const std::string_view bytes = testing::view(testing::kPalettePng);
  for (std::size_t place = 0; place < bytes.size(); ++place) {
    std::string damaged(bytes);
    damaged[place] = static_cast<char>(damaged[place] ^ 0x10);
    auto file = stream(damaged);
    EXPECT_NE(read_essential_png(file).problem, "") << place;
  }
}

/// A number of so many bytes, little- or big-endian.
std::string number(std::uint64_t value, int bytes, bool little) {
  std::string text;
  for (int i = 0; i < bytes; ++i) {
    const int shift = 8 * (little ? i : bytes - 1 - i);
    text += static_cast<char>(value >> shift & 0xFFU);
  }
  return text;
}

/// A TIFF with one strip of 10 bytes that ends with the file.
std::string tiff(bool little, bool big, int compression = 1) {
  const int offset = big ? 8 : 4;
  const std::uint64_t directory = big ? 16 : 8;
  const std::uint64_t data = directory + (big ? 8 + 3 * 20 + 8 : 2 + 3 * 12 + 4);
  std::string bytes = little ? "II" : "MM";
  bytes += number(big ? 43 : 42, 2, little);
  if (big) bytes += number(8, 2, little) + number(0, 2, little);
  bytes += number(directory, offset, little) + number(3, big ? 8 : 2, little);
  bytes += number(259, 2, little) + number(3, 2, little) + number(1, offset, little);
  bytes += number(static_cast<std::uint64_t>(compression), 2, little);
  bytes += std::string(big ? 6 : 2, '\0');
  bytes += number(273, 2, little) + number(4, 2, little) + number(1, offset, little);
  bytes += number(data, 4, little) + std::string(big ? 4 : 0, '\0');
  bytes += number(279, 2, little) + number(3, 2, little) + number(1, offset, little);
  bytes += number(10, 2, little) + std::string(big ? 6 : 2, '\0');
  return bytes + number(0, offset, little) + std::string(10, 'x');
}

std::string problem(const std::string& bytes) {
  std::istringstream file(bytes);
  return tiff_problem(file);
}

TEST(TiffOutline, AWholeFileOfAnyKindIsAccepted) {
  for (const bool little : {true, false}) {
    for (const bool big : {true, false}) EXPECT_EQ(problem(tiff(little, big)), "");
  }
}

TEST(TiffOutline, EveryCutBehindTheHeaderIsNoticed) {
  for (const bool little : {true, false}) {
    for (const bool big : {true, false}) {
      const std::string bytes = tiff(little, big);
      for (std::size_t cut = 4; cut < bytes.size(); ++cut) {
        EXPECT_EQ(problem(bytes.substr(0, cut)), "is truncated: the file ends before its TIFF data")
            << cut;
      }
    }
  }
}

TEST(TiffOutline, OtherStreamsAreAccepted) {
  for (const char* other : {"", "I", "a letter"}) EXPECT_EQ(problem(other), "") << other;
}

TEST(TiffOutline, ACompressionThatNoDecoderKnowsIsNamed) {
  EXPECT_EQ(problem(tiff(true, false, 5)), "");
  EXPECT_EQ(problem(tiff(false, true, 136)),
            "its TIFF compression 136 cannot be read: save it as PNG");
}

}  // namespace

}  // namespace lensforge
