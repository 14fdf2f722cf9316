// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "core/image/picture_outline.h"
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

}  // namespace
}  // namespace lensforge
