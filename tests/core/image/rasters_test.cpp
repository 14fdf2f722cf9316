// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/rasters.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using testing::message_of;
using testing::TempFolder;

LayeredImage two_layers() {
  LayeredImage image(3, 2, {"part.z", "part.slope_x", "a cause"});
  for (const std::string& name : image.names()) {
    float value = static_cast<float>(name.size()) * 0.1F;
    for (float& cell : image.layer(name)) cell = value += 1.25e-7F;
  }
  return image;
}

TEST(LayeredImage, ComesBackToTheBitUnderItsNames) {
  const TempFolder folder;
  const LayeredImage image = two_layers();
  write_layers(image, folder / "part.exr");
  const LayeredImage back = read_layers(folder / "part.exr");
  EXPECT_EQ(back.columns(), 3);
  EXPECT_EQ(back.rows(), 2);
  EXPECT_EQ(back.names(), image.names());
  for (const std::string& name : image.names()) {
    const auto wanted = image.layer(name);
    EXPECT_TRUE(std::equal(wanted.begin(), wanted.end(), back.layer(name).begin())) << name;
  }
  EXPECT_FALSE(back.has("part.slope_y"));
}

TEST(LayeredImage, HasTheSameBytesAgainAndTheProgramsMark) {
  const TempFolder folder;
  write_layers(two_layers(), folder / "a.exr");
  write_layers(two_layers(), folder / "b.exr");
  EXPECT_TRUE(testing::read_bytes(folder / "a.exr") == testing::read_bytes(folder / "b.exr"));
  EXPECT_TRUE(written_by_lensforge(folder / "a.exr"));
}

TEST(LayeredImage, WhatIsMissingDamagedOrNotFiniteIsRefusedByName) {
  const TempFolder folder;
  const auto refused = [&](const char* name) {
    return message_of<InputError>([&] { read_layers(folder / name); });
  };
  EXPECT_THAT(refused("none.exr"), HasSubstr("none.exr"));
  testing::write_bytes(folder / "text.exr", "no picture");
  EXPECT_THAT(refused("text.exr"), HasSubstr("text.exr: cannot be read"));
  write_layers(two_layers(), folder / "cut.exr");
  const std::string bytes = testing::read_bytes(folder / "cut.exr");
  testing::write_bytes(folder / "cut.exr", bytes.substr(0, bytes.size() - 20));
  EXPECT_THAT(refused("cut.exr"), HasSubstr("cut.exr: "));
  LayeredImage odd = two_layers();
  odd.layer("part.z")[1] = std::numeric_limits<float>::quiet_NaN();
  write_layers(odd, folder / "nan.exr");
  EXPECT_THAT(refused("nan.exr"), HasSubstr("not finite"));
}

using ::testing::AllOf;

HeightGrid sample_grid(int columns, int rows) {
  HeightGrid grid{columns, rows, {}};
  for (int k = 0; k < columns * rows; ++k) {
    grid.heights.push_back(-0.1F * static_cast<float>(k) - 1e-6F);
  }
  return grid;
}

/// Writes values of a type as OpenImageIO does by the name of the file, as often as there are
/// channels, each later one dark.
void write(const HeightGrid& grid, const std::string& path, OIIO::TypeDesc type, int channels = 1) {
  std::vector<float> values;
  for (const float z : grid.heights) {
    values.push_back(z);
    values.insert(values.end(), static_cast<std::size_t>(channels - 1), 0.0F);
  }
  const auto file = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(file) << path;
  ASSERT_TRUE(file->open(path, OIIO::ImageSpec(grid.columns, grid.rows, channels, type)));
  ASSERT_TRUE(file->write_image(OIIO::TypeDesc::FLOAT, values.data())) << file->geterror();
  ASSERT_TRUE(file->close());
}

/// As pages on the format have it: rows from the bottom, little-endian by a scale below 0.
void write_pfm(const HeightGrid& grid, const std::filesystem::path& path) {
  std::string bytes = "Pf\n" + std::to_string(grid.columns) + " ";
  bytes += std::to_string(grid.rows) + "\n-1.0\n";
  for (int row = grid.rows - 1; row >= 0; --row) {
    const float* const first = grid.heights.data() + std::ptrdiff_t{row} * grid.columns;
    bytes.append(reinterpret_cast<const char*>(first),
                 static_cast<std::size_t>(grid.columns) * sizeof(float));
  }
  testing::write_bytes(path, bytes);
}

TEST(HeightGrid, ComesBackToTheBit) {
  const TempFolder folder;
  const HeightGrid grid = sample_grid(7, 5);
  write_heights(grid, folder / "front.exr");
  EXPECT_EQ(read_heights(folder / "front.exr"), grid);
}

TEST(HeightGrid, TheFirstChannelOfEveryFormatOfFloatsIsRead) {
  const TempFolder folder;
  const HeightGrid grid = sample_grid(7, 5);
  for (const char* const name : {"heights.exr", "heights.tif"}) {
    const std::string path = (folder / name).string();
    write(grid, path, OIIO::TypeDesc::FLOAT, 3);
    EXPECT_EQ(read_heights(path), grid) << name;
  }
  write_pfm(grid, folder / "heights.pfm");
  EXPECT_EQ(read_heights(folder / "heights.pfm"), grid);
}

TEST(HeightGrid, WhatHoldsNoHeightsIsRefusedInOneLine) {
  const TempFolder folder;
  const std::string path = (folder / "bad.exr").string();
  const auto refusal = [&](const std::string& file) {
    return message_of<InputError>([&] { (void)read_heights(file); });
  };
  EXPECT_THAT(refusal((folder / "none.exr").string()), HasSubstr("none.exr"));
  const std::string whole = (folder / "bad.tif").string();
  write(sample_grid(7, 5), whole, OIIO::TypeDesc::UINT8);
  EXPECT_THAT(refusal(whole), AllOf(HasSubstr("whole numbers of 8 bits"), HasSubstr("floats")));
  write(sample_grid(7, 3), path, OIIO::TypeDesc::FLOAT);
  EXPECT_THAT(refusal(path), AllOf(HasSubstr("7 x 3 samples"), HasSubstr("4 to 4096 a side")));
  write(sample_grid(4097, 4), path, OIIO::TypeDesc::FLOAT);
  EXPECT_THAT(refusal(path), HasSubstr("4097 x 4 samples"));
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    HeightGrid grid = sample_grid(7, 5);
    grid.heights[16] = bad;
    write(grid, path, OIIO::TypeDesc::FLOAT);
    EXPECT_THAT(refusal(path), HasSubstr("the height at column 2, row 2 is not finite"));
  }
}

}  // namespace

}  // namespace lensforge
