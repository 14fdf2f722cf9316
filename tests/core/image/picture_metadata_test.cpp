// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/image/image_io.h"
#include "core/image/metadata_samples.h"
#include "core/image/picture_codec.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

using namespace lensforge::testing;
using OIIO::TypeDesc;
using ::testing::IsEmpty;

OIIO::ImageSpec three_by_two() { return OIIO::ImageSpec(3, 2, 3, TypeDesc::UINT8); }

/// White in the left upper corner, else black.
std::vector<float> white_corner() {
  std::vector<float> pixels(18, 0.0F);
  pixels[0] = pixels[1] = pixels[2] = 1.0F;
  return pixels;
}

/// Corner in which a viewer shows the white square, in words.
std::string corner_of(const Image& image) {
  const int right = image.columns() - 1;
  const int bottom = image.rows() - 1;
  if (image.at(0, 0) > 0.5F) return "left top";
  if (image.at(right, 0) > 0.5F) return "right top";
  if (image.at(right, bottom) > 0.5F) return "right bottom";
  return image.at(0, bottom) > 0.5F ? "left bottom" : "nowhere";
}

/// The corner that the first pixel comes to with each orientation (JEITA CP-3451, tag 274).
const std::vector<std::string> kCorners{
    "",         "left top",  "right top",    "right bottom", "left bottom",
    "left top", "right top", "right bottom", "left bottom"};

void expect_turned(const std::filesystem::path& path, int orientation) {
  const LoadedImage loaded = read_image(path);
  EXPECT_EQ(corner_of(loaded.image), kCorners[static_cast<std::size_t>(orientation)])
      << path << orientation;
  EXPECT_EQ(loaded.image.columns(), orientation < 5 ? 3 : 2) << path << orientation;
  const std::string said = "turned upright (EXIF orientation " + std::to_string(orientation) + ")";
  const auto changes = orientation == 1 ? std::vector<std::string>() : std::vector{said};
  EXPECT_EQ(loaded.changes, changes);
}

TEST(PictureMetadata, AWebpIsTurnedByItsExifWithOrWithoutJpegsPrefix) {
  const TempFolder folder;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    for (const std::string& prefix : {std::string(), std::string("Exif\0\0", 6)}) {
      write_webp(folder / "a.webp", three_by_two(), white_corner(),
                 {.profile = {}, .exif = prefix + exif_of(orientation)});
      expect_turned(folder / "a.webp", orientation);
    }
  }
}

TEST(PictureMetadata, APngIsTurnedByItsExifChunk) {
  const TempFolder folder;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    write_raw(folder / "a.png", three_by_two(), white_corner());
    std::string bytes = read_bytes(folder / "a.png");
    bytes.insert(33, png_chunk("eXIf", exif_of(orientation)));
    write_bytes(folder / "a.png", bytes);
    expect_turned(folder / "a.png", orientation);
  }
}

TEST(PictureMetadata, AHeicIsTurnedOnceByItsTransformationAndNotByExif) {
  const TempFolder folder;
  for (const bool turned : {false, true}) {
    for (const std::string& exif : {std::string(), exif_of(6)}) {
      write_heic(folder / "a.heic", 96, 64, {.profile = {}, .exif = exif, .turned = turned});
      const LoadedImage loaded = read_image(folder / "a.heic");
      EXPECT_EQ(loaded.image.columns(), turned ? 64 : 96);
      EXPECT_EQ(corner_of(loaded.image), turned ? "left bottom" : "right bottom");
      EXPECT_THAT(loaded.changes, IsEmpty());
    }
  }
}

TEST(PictureMetadata, BrokenExifOfAWebpTurnsNothing) {
  const TempFolder folder;
  const std::string good = exif_of(6);
  for (std::size_t size = 1; size < good.size(); ++size) {
    write_webp(folder / "a.webp", three_by_two(), white_corner(),
               {.profile = {}, .exif = good.substr(0, size)});
    EXPECT_FALSE(read_image(folder / "a.webp").image.empty()) << size;
  }
}

}  // namespace
}  // namespace lensforge
