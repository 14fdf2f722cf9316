// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "core/image/picture_outline.h"
#include "core/sample_files.h"

namespace lensforge {
namespace {

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

}  // namespace
}  // namespace lensforge
