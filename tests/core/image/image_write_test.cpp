// SPDX-License-Identifier: GPL-3.0-or-later
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/full_disk.h"
#include "core/image/image_io.h"
#include "core/image/transfer.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

using lensforge::testing::FullDisk;
using lensforge::testing::message_of;
using lensforge::testing::random_image;
using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using OIIO::TypeDesc;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST(ImageIo, AWrittenPngIsSixteenBitGreyAndComesBackWithinAStep) {
  const TempFolder folder;
  const Image image = random_image(31, 17);
  write_image(image, folder / "a.png");
  const auto input = OIIO::ImageInput::open((folder / "a.png").string());
  ASSERT_TRUE(input);
  EXPECT_EQ(input->spec().format, TypeDesc::UINT16);
  EXPECT_EQ(input->spec().nchannels, 1);
  EXPECT_EQ(input->spec().get_string_attribute("oiio:ColorSpace"), "sRGB");
  const LoadedImage loaded = read_image(folder / "a.png");
  EXPECT_THAT(loaded.changes, IsEmpty());
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    EXPECT_NEAR(encode(loaded.image.values()[i]), encode(image.values()[i]), 0.51 / 65535.0);
  }
}

TEST(ImageIo, AWrittenPngIsClippedToTheDisplay) {
  const TempFolder folder;
  Image image(2, 1, -1.0F);
  image.at(1, 0) = 5.0F;
  write_image(image, folder / "a.png");
  EXPECT_THAT(read_image(folder / "a.png").image.values(), ElementsAre(0.0F, 1.0F));
}

TEST(ImageIo, AWrittenExrComesBackBitForBit) {
  const TempFolder folder;
  Image image = random_image(31, 17);
  image.at(0, 0) = 12345.678F;
  image.at(1, 0) = 1e-30F;
  write_image(image, folder / "a.exr");
  const LoadedImage loaded = read_image(folder / "a.exr");
  EXPECT_EQ(loaded.image, image);
  EXPECT_THAT(loaded.changes, IsEmpty());
  const auto input = OIIO::ImageInput::open((folder / "a.exr").string());
  EXPECT_THAT(input->spec().channelnames, ElementsAre("Y"));
  EXPECT_EQ(input->spec().format, TypeDesc::FLOAT);
}

TEST(ImageIo, WritingTwiceGivesTheSameBytes) {
  const TempFolder folder;
  const Image image = random_image(31, 17);
  for (const std::string extension : {".png", ".exr"}) {
    write_image(image, folder / ("a" + extension));
    // Past the next second, which a time stamp in the file would show.
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    write_image(image, folder / ("b" + extension));
    EXPECT_EQ(read_bytes(folder / ("a" + extension)), read_bytes(folder / ("b" + extension)));
  }
}

TEST(ImageIo, AColourPictureIsWrittenAsEightBitPng) {
  const TempFolder folder;
  write_image(ColorImage{2, 1, {255, 0, 0, 10, 20, 30}}, folder / "c.png");
  const auto input = OIIO::ImageInput::open((folder / "c.png").string());
  ASSERT_TRUE(input);
  EXPECT_EQ(input->spec().format, TypeDesc::UINT8);
  std::vector<unsigned char> rgb(6);
  ASSERT_TRUE(input->read_image(0, 0, 0, 3, TypeDesc::UINT8, rgb.data()));
  EXPECT_THAT(rgb, ElementsAre(255, 0, 0, 10, 20, 30));
}

TEST(ImageIo, AnotherExtensionIsRefused) {
  const TempFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { write_image(Image(1, 1), folder / "a.jpg"); }),
              HasSubstr("extension '.jpg' is not written"));
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(ImageIo, AFullDiskNamesFileAndReasonAndLeavesNothing) {
  const TempFolder folder;
  const Image image = random_image(128, 128);
  const FullDisk full(1000);
  for (const std::string name : {"a.png", "a.exr"}) {
    EXPECT_THAT(message_of<RunError>([&] { write_image(image, folder / name); }),
                AllOf(StartsWith((folder / name).string() + ": "), HasSubstr("File too large")));
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(ImageIo, AMissingFolderNamesFileAndReason) {
  const TempFolder folder;
  EXPECT_THAT(message_of<RunError>([&] { write_image(Image(1, 1), folder / "no/a.png"); }),
              HasSubstr("No such file or directory"));
}

}  // namespace
}  // namespace lensforge
