// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image_io.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/full_disk.h"
#include "core/image/color.h"
#include "core/image/picture_refusal.h"
#include "core/sample_files.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::pixel_spec;
using lensforge::testing::ramp;
using lensforge::testing::TempFolder;
using lensforge::testing::view;
using lensforge::testing::write_bytes;
using lensforge::testing::write_raw;
using OIIO::TypeDesc;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr const char* kLuminanceChange = "colour turned to luminance (Rec. 709)";
constexpr const char* kAlphaChange = "transparency flattened onto black";

/// The light of the only pixel of a picture with these stored values.
float light_of_pixel(const fs::path& path, const OIIO::ImageSpec& spec,
                     const std::vector<float>& stored) {
  write_raw(path, spec, stored);
  return read_image(path).image.at(0, 0);
}

// ---- depths, channels, formats

TEST(ImageIo, ReadsEveryFormatAndDepth) {
  const TempFolder folder;
  const std::vector<std::pair<std::string, TypeDesc>> kinds{
      {"8.png", TypeDesc::UINT8},   {"16.png", TypeDesc::UINT16}, {"8.tif", TypeDesc::UINT8},
      {"16.tif", TypeDesc::UINT16}, {"32.tif", TypeDesc::UINT32}, {"f.tif", TypeDesc::FLOAT},
      {"d.tif", TypeDesc::DOUBLE},  {"h.exr", TypeDesc::HALF},    {"f.exr", TypeDesc::FLOAT}};
  for (const auto& [name, type] : kinds) {
    OIIO::ImageSpec spec(16, 8, 1, type);
    write_raw(folder / name, spec, ramp(spec));
    const LoadedImage loaded = read_image(folder / name);
    EXPECT_THAT(loaded.changes, IsEmpty()) << name;
    ASSERT_EQ(loaded.image.columns(), 16) << name;
    ASSERT_EQ(loaded.image.rows(), 8) << name;
    const bool is_float = TypeDesc(type).is_floating_point();
    for (int i = 0; i < 128; ++i) {
      const double stored = i / 127.0;
      const double expected = is_float ? stored : decode(stored);
      EXPECT_NEAR(loaded.image.at(i % 16, i / 16), expected, 5e-3) << name << " " << i;
    }
  }
}

TEST(ImageIo, EightAndSixteenBitsAreDecodedExactly) {
  const TempFolder folder;
  OIIO::ImageSpec spec(256, 1, 1, TypeDesc::UINT8);
  write_raw(folder / "8.png", spec, ramp(spec));
  spec.set_format(TypeDesc::UINT16);
  write_raw(folder / "16.png", spec, ramp(spec));
  const Image eight = read_image(folder / "8.png").image;
  const Image sixteen = read_image(folder / "16.png").image;
  for (int i = 0; i < 256; ++i) {
    EXPECT_EQ(eight.at(i, 0), static_cast<float>(decode(i / 255.0)));
    EXPECT_EQ(sixteen.at(i, 0), eight.at(i, 0));
  }
}

TEST(ImageIo, ReadsAJpeg) {
  const TempFolder folder;
  OIIO::ImageSpec spec(16, 16, 3, TypeDesc::UINT8);
  write_raw(folder / "a.jpg", spec, std::vector<float>(16 * 16 * 3, 0.5F));
  const LoadedImage loaded = read_image(folder / "a.jpg");
  EXPECT_NEAR(loaded.image.at(3, 3), decode(0.5), 5e-3);
}

TEST(ImageIo, ColourBecomesLuminanceOfLinearLight) {
  const TempFolder folder;
  write_raw(folder / "c.png", pixel_spec(3, TypeDesc::UINT8), {1.0F, 0.2F, 0.6F});
  const LoadedImage loaded = read_image(folder / "c.png");
  EXPECT_NEAR(loaded.image.at(0, 0), 0.2126 + 0.7152 * decode(0.2) + 0.0722 * decode(0.6), 1e-7);
  EXPECT_THAT(loaded.changes, ElementsAre(kLuminanceChange));
}

TEST(ImageIo, GreyStoredAsColourIsTakenAsItIs) {
  const TempFolder folder;
  write_raw(folder / "c.png", pixel_spec(3, TypeDesc::UINT8), {0.6F, 0.6F, 0.6F});
  const LoadedImage loaded = read_image(folder / "c.png");
  EXPECT_EQ(loaded.image.at(0, 0), static_cast<float>(decode(0.6)));
  EXPECT_THAT(loaded.changes, IsEmpty());
}

TEST(ImageIo, ColoursAreReadAsLinearLightOfThePrimaries) {
  const TempFolder folder;
  write_raw(folder / "c.png", pixel_spec(3, TypeDesc::UINT8), {1.0F, 0.2F, 0.6F});
  const LoadedColors colors = read_colors(folder / "c.png");
  EXPECT_EQ(colors.light[0].at(0, 0), 1.0F);
  EXPECT_EQ(colors.light[1].at(0, 0), static_cast<float>(decode(0.2)));
  EXPECT_EQ(colors.light[2].at(0, 0), static_cast<float>(decode(0.6)));
  EXPECT_THAT(colors.changes, IsEmpty());

  write_raw(folder / "g.png", pixel_spec(3, TypeDesc::UINT8), {0.6F, 0.6F, 0.6F});
  for (const Image& light : read_colors(folder / "g.png").light) {
    EXPECT_EQ(light, read_image(folder / "g.png").image);
  }
  write_bytes(folder / "a.svg",
              "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 4 4'>"
              "<rect width='4' height='4' fill='#ff0033'/></svg>");
  const LoadedColors drawn = read_colors(folder / "a.svg", {}, 4);
  EXPECT_EQ(drawn.light[0].at(1, 1), 1.0F);
  EXPECT_EQ(drawn.light[1].at(1, 1), 0.0F);
  EXPECT_NEAR(drawn.light[2].at(1, 1), decode(0.2), 1e-6);
}

TEST(ImageIo, ColoursShowTheBackgroundsColourWhereTheyAreTransparent) {
  const TempFolder folder;
  const std::string path = folder / "c.png";
  write_raw(path, OIIO::ImageSpec(2, 1, 4, TypeDesc::UINT8),
            {0.0F, 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 1.0F, 0.0F});
  // Nothing of the picture is red, which a grey picture of red light alone would be refused for.
  const LoadedColors colors = read_colors(path, {}, kDrawnSide, Background::parse("#00ff00"));
  EXPECT_EQ(colors.light[0].total(), 0.0);
  EXPECT_EQ(colors.light[1].at(0, 0), 0.0F);
  EXPECT_EQ(colors.light[1].at(1, 0), 1.0F);
  EXPECT_EQ(colors.light[2].at(0, 0), 1.0F);
  EXPECT_EQ(colors.light[2].at(1, 0), 0.0F);
}

TEST(ImageIo, FurtherChannelsAreLeftOutWithAMessage) {
  const TempFolder folder;
  OIIO::ImageSpec spec = pixel_spec(5, TypeDesc::FLOAT);
  spec.channelnames = {"R", "G", "B", "mask", "id"};
  write_raw(folder / "n.exr", spec, {0.5F, 0.5F, 0.5F, 9.0F, 7.0F});
  const LoadedImage loaded = read_image(folder / "n.exr");
  EXPECT_EQ(loaded.image.at(0, 0), 0.5F);
  EXPECT_THAT(loaded.changes, ElementsAre("2 further channels left out"));
}

TEST(ImageIo, ChannelsAreFoundByNameWhateverTheirOrder) {
  const TempFolder folder;
  OIIO::ImageSpec spec = pixel_spec(4, TypeDesc::FLOAT);
  spec.channelnames = {"Z", "Y", "A", "extra"};
  spec.alpha_channel = 2;
  spec.z_channel = 0;
  write_raw(folder / "y.exr", spec, {100.0F, 0.25F, 1.0F, 3.0F});
  EXPECT_EQ(read_image(folder / "y.exr").image.at(0, 0), 0.25F);
}

TEST(ImageIo, ReadsAPalettePng) {
  const TempFolder folder;
  write_bytes(folder / "p.png", view(lensforge::testing::kPalettePng));
  const Image image = read_image(folder / "p.png").image;
  EXPECT_EQ(image.at(0, 0), 0.0F);
  EXPECT_EQ(image.at(1, 0), static_cast<float>(decode(188.0 / 255.0)));
  EXPECT_EQ(image.at(0, 1), 1.0F);
  EXPECT_FLOAT_EQ(image.at(1, 1), 0.2126F);
}

TEST(ImageIo, ReadsAnInterlacedPng) {
  const TempFolder folder;
  write_bytes(folder / "i.png", view(lensforge::testing::kInterlacedPng));
  const Image image = read_image(folder / "i.png").image;
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(image.at(i % 2, i / 2), static_cast<float>(decode(i / 3.0)));
  }
}

TEST(ImageIo, ReadsACmykJpeg) {
  const TempFolder folder;
  write_bytes(folder / "k.jpg", view(lensforge::testing::kCmykJpeg));
  EXPECT_NEAR(read_image(folder / "k.jpg").image.at(4, 4), decode(0.5), 0.01);
}

TEST(ImageIo, ReadsTiledPicturesOfAnySize) {
  const TempFolder folder;
  for (const std::string name : {"t.exr", "t.tif"}) {
    OIIO::ImageSpec spec(50, 37, 1, TypeDesc::FLOAT);
    spec.tile_width = spec.tile_height = 16;
    write_raw(folder / name, spec, ramp(spec));
    const Image image = read_image(folder / name).image;
    const std::vector<float> expected = ramp(spec);
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), image.values().begin())) << name;
  }
}

TEST(ImageIo, AFileIsKnownByItsContentNotItsName) {
  const TempFolder folder;
  write_raw(folder / "a.png", pixel_spec(1, TypeDesc::UINT8), {1.0F});
  fs::rename(folder / "a.png", folder / "a.jpg");
  EXPECT_EQ(read_image(folder / "a.jpg").image.at(0, 0), 1.0F);
}

TEST(ImageIo, OnlyTheFirstOfSeveralPicturesIsReadWithAMessage) {
  const TempFolder folder;
  const std::string path = (folder / "two.tif").string();
  const OIIO::ImageSpec spec = pixel_spec(1, TypeDesc::UINT8);
  const auto output = OIIO::ImageOutput::create(path);
  const unsigned char first = 255;
  const unsigned char second = 0;
  ASSERT_TRUE(output->open(path, spec) && output->write_image(TypeDesc::UINT8, &first));
  ASSERT_TRUE(output->open(path, spec, OIIO::ImageOutput::AppendSubimage) &&
              output->write_image(TypeDesc::UINT8, &second) && output->close());
  const LoadedImage loaded = read_image(path);
  EXPECT_EQ(loaded.image.at(0, 0), 1.0F);
  EXPECT_THAT(loaded.changes, ElementsAre("only the first of several pictures read"));
}

// ---- colour spaces

TEST(ImageIo, APngGammaIsHonoured) {
  const TempFolder folder;
  OIIO::ImageSpec spec = pixel_spec(1, TypeDesc::UINT16);
  spec.attribute("oiio:ColorSpace", "Gamma1.8");
  EXPECT_NEAR(light_of_pixel(folder / "g.png", spec, {0.5F}), std::pow(0.5, 1.8), 1e-4);
  spec.attribute("oiio:ColorSpace", "linear");
  EXPECT_NEAR(light_of_pixel(folder / "l.png", spec, {0.5F}), 0.5, 1e-4);
}

TEST(ImageIo, ABrokenProfileOfAPngIsSaidAndNotPrintedAbout) {
  const TempFolder folder;
  write_bytes(folder / "w.png", view(lensforge::testing::kProfilePng));
  ::testing::internal::CaptureStderr();
  const LoadedImage loaded = read_image(folder / "w.png");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(loaded.image.at(0, 0), static_cast<float>(decode(128.0 / 255.0)));
  EXPECT_THAT(loaded.changes, ElementsAre("embedded colour profile is broken: read as sRGB"));
}

TEST(ImageIo, LightAboveWhiteIsKept) {
  const TempFolder folder;
  EXPECT_EQ(light_of_pixel(folder / "h.exr", pixel_spec(1, TypeDesc::FLOAT), {25.0F}), 25.0F);
}

// ---- alpha

TEST(ImageIo, AlphaIsAppliedInLinearLightWithAMessage) {
  const TempFolder folder;
  write_raw(folder / "la.png", pixel_spec(2, TypeDesc::UINT16), {0.8F, 0.25F});
  write_raw(folder / "rgba.png", pixel_spec(4, TypeDesc::UINT16), {0.8F, 0.8F, 0.8F, 0.25F});
  for (const char* name : {"la.png", "rgba.png"}) {
    const LoadedImage loaded = read_image(folder / name);
    EXPECT_NEAR(loaded.image.at(0, 0), 0.25 * decode(0.8), 2e-5) << name;
    EXPECT_THAT(loaded.changes, ElementsAre(kAlphaChange)) << name;
  }
}

TEST(ImageIo, AnOpaqueAlphaChannelChangesNothing) {
  const TempFolder folder;
  write_raw(folder / "la.png", pixel_spec(2, TypeDesc::UINT8), {0.6F, 1.0F});
  const LoadedImage loaded = read_image(folder / "la.png");
  EXPECT_EQ(loaded.image.at(0, 0), static_cast<float>(decode(0.6)));
  EXPECT_THAT(loaded.changes, IsEmpty());
}

TEST(ImageIo, TransparentWhiteIsBlack) {
  const TempFolder folder;
  write_raw(folder / "t.png", OIIO::ImageSpec(2, 1, 2, TypeDesc::UINT8), {1.0F, 0.0F, 1.0F, 1.0F});
  const Image image = read_image(folder / "t.png").image;
  EXPECT_EQ(image.at(0, 0), 0.0F);
  EXPECT_EQ(image.at(1, 0), 1.0F);
}

TEST(ImageIo, AssociatedAlphaOfAnExrIsNotAppliedTwice) {
  const TempFolder folder;
  OIIO::ImageSpec spec = pixel_spec(4, TypeDesc::FLOAT);
  spec.attribute("oiio:UnassociatedAlpha", 0);
  write_raw(folder / "a.exr", spec, {0.2F, 0.2F, 0.2F, 0.5F});
  const LoadedImage loaded = read_image(folder / "a.exr");
  EXPECT_EQ(loaded.image.at(0, 0), 0.2F);
  EXPECT_THAT(loaded.changes, ElementsAre(kAlphaChange));
}

TEST(ImageIo, BothAlphaConventionsOfTiffGiveTheSameLight) {
  const TempFolder folder;
  OIIO::ImageSpec spec = pixel_spec(4, TypeDesc::UINT16);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  EXPECT_NEAR(light_of_pixel(folder / "u.tif", spec, {0.8F, 0.8F, 0.8F, 0.5F}), 0.5 * decode(0.8),
              3e-5);
  spec.attribute("oiio:UnassociatedAlpha", 0);
  EXPECT_NEAR(light_of_pixel(folder / "a.tif", spec, {0.4F, 0.4F, 0.4F, 0.5F}), 0.5 * decode(0.8),
              3e-5);
}

// ---- geometry

TEST(ImageIo, ExifOrientationIsHonouredWithAMessage) {
  const TempFolder folder;
  // Stored 3 x 2:  1 2 3 / 4 5 6, as hundredths. How a viewer shows it for each orientation:
  const std::vector<std::vector<int>> shown{{},
                                            {1, 2, 3, 4, 5, 6},
                                            {3, 2, 1, 6, 5, 4},
                                            {6, 5, 4, 3, 2, 1},
                                            {4, 5, 6, 1, 2, 3},
                                            {1, 4, 2, 5, 3, 6},
                                            {4, 1, 5, 2, 6, 3},
                                            {6, 3, 5, 2, 4, 1},
                                            {3, 6, 2, 5, 1, 4}};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    OIIO::ImageSpec spec(3, 2, 1, TypeDesc::FLOAT);
    spec.attribute("Orientation", orientation);
    const fs::path path = folder / (std::to_string(orientation) + ".tif");
    write_raw(path, spec, {0.01F, 0.02F, 0.03F, 0.04F, 0.05F, 0.06F});
    const LoadedImage loaded = read_image(path);
    std::vector<int> seen;
    for (const float value : loaded.image.values()) {
      seen.push_back(static_cast<int>(std::lround(100.0F * value)));
    }
    EXPECT_EQ(loaded.image.columns(), orientation < 5 ? 3 : 2);
    EXPECT_EQ(seen, shown[static_cast<std::size_t>(orientation)]) << orientation;
    EXPECT_EQ(loaded.changes.empty(), orientation == 1) << orientation;
  }
}

TEST(ImageIo, AnExrIsFittedToItsDisplayWindow) {
  const TempFolder folder;
  OIIO::ImageSpec spec(2, 1, 1, TypeDesc::FLOAT);
  spec.x = -1;
  spec.full_x = 0;
  spec.full_width = 3;
  spec.full_height = 2;
  write_raw(folder / "w.exr", spec, {0.5F, 0.25F});
  const LoadedImage loaded = read_image(folder / "w.exr");
  ASSERT_EQ(loaded.image.columns(), 3);
  ASSERT_EQ(loaded.image.rows(), 2);
  EXPECT_EQ(loaded.image.at(0, 0), 0.25F);
  EXPECT_EQ(loaded.image.total(), 0.25);
  EXPECT_THAT(loaded.changes, ElementsAre("fitted to the display window of 3 x 2 pixels"));
}

TEST(ImageIo, AOnePixelPictureIsRead) {
  const TempFolder folder;
  EXPECT_EQ(light_of_pixel(folder / "1.png", pixel_spec(1, TypeDesc::UINT8), {1.0F}), 1.0F);
}

using namespace lensforge::testing;
using ::testing::HasSubstr;

Image read(const std::filesystem::path& path, const std::string& background) {
  return read_image(path, {}, kDrawnSide, Background::parse(background)).image;
}

std::string refusal(const std::filesystem::path& path, const std::string& background) {
  return message_of<InputError>([&] { read(path, background); });
}

/// Two pixels of a colour, the first open, the second with this alpha.
void write_logo(const std::filesystem::path& path, float colour, float alpha) {
  write_raw(path, OIIO::ImageSpec(2, 1, 4, TypeDesc::UINT16),
            {colour, colour, colour, 0.0F, colour, colour, colour, alpha});
}

TEST(Background, IsReadAndWrittenInWords) {
  EXPECT_EQ(Background::parse("black"), Background{});
  EXPECT_EQ(Background::parse("white").rgb, (std::array{255, 255, 255}));
  EXPECT_EQ(Background::parse("#12aBfF").rgb, (std::array{0x12, 0xAB, 0xFF}));
  for (const std::string text : {"black", "white", "#12abff"}) {
    EXPECT_EQ(Background::parse(text).text(), text);
  }
  for (const std::string text :
       {"", "grey", "#12345", "#1234567", "#12345g", "123456", "#+12345"}) {
    EXPECT_EQ(message_of<InputError>([&] { Background::parse(text); }),
              "--background '" + text + "': must be black, white or #RRGGBB; #ffffff works");
  }
}

TEST(Background, ItsLightIsItsLuminance) {
  EXPECT_EQ(Background::parse("black").light(), 0.0);
  EXPECT_EQ(Background::parse("white").light(), 1.0);
  EXPECT_EQ(Background::parse("#808080").light(), decode(128.0 / 255.0));
  EXPECT_DOUBLE_EQ(Background::parse("#ff8000").light(),
                   luminance_rec709({1.0, decode(128.0 / 255.0), 0.0}));
}

TEST(Background, ShowsThroughInLinearLight) {
  const TempFolder folder;
  write_logo(folder / "a.png", 0.8F, 0.25F);
  const double colour = decode(0.8);
  for (const std::string text : {"black", "white", "#336699"}) {
    const double behind = Background::parse(text).light();
    const Image image = read(folder / "a.png", text);
    EXPECT_NEAR(image.at(0, 0), behind, 1e-6) << text;
    EXPECT_NEAR(image.at(1, 0), 0.25 * colour + 0.75 * behind, 2e-5) << text;
  }
  OIIO::ImageSpec spec(2, 1, 4, TypeDesc::FLOAT);
  spec.attribute("oiio:UnassociatedAlpha", 0);
  write_raw(folder / "a.exr", spec, {0.2F, 0.2F, 0.2F, 0.5F, 0.0F, 0.0F, 0.0F, 0.0F});
  EXPECT_NEAR(read(folder / "a.exr", "white").at(0, 0), 0.2 + 0.5, 1e-6);
  EXPECT_NEAR(read(folder / "a.exr", "white").at(1, 0), 1.0, 1e-6);
}

TEST(Background, ShowsThroughDrawings) {
  const TempFolder folder;
  write_bytes(folder / "a.svg",
              "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 2 1'>"
              "<rect width='1' height='1'/></svg>");
  const Image image = read(folder / "a.svg", "#ffffff");
  EXPECT_EQ(image.at(0, 0), 0.0F);
  EXPECT_EQ(image.at(image.columns() - 1, 0), 1.0F);
  EXPECT_THAT(refusal(folder / "a.svg", "black"), HasSubstr("use --background white"));
}

TEST(Background, WhatCannotBeToldFromItIsRefusedWithOneThatWorks) {
  const TempFolder folder;
  const std::string path = (folder / "a.png").string();
  write_logo(path, 0.0F, 1.0F);
  EXPECT_EQ(refusal(path, "black"),
            path +
                ": is black all over, since transparency is flattened onto black: use --background "
                "white");
  EXPECT_EQ(read(path, "white").at(1, 0), 0.0F);
  write_logo(path, 1.0F, 1.0F);
  EXPECT_THAT(refusal(path, "white"), HasSubstr("is of one brightness all over"));
  EXPECT_THAT(refusal(path, "white"), HasSubstr("use --background black"));
  EXPECT_EQ(read(path, "black").at(1, 0), 1.0F);
  write_logo(path, 0.5F, 0.0F);
  for (const char* text : {"black", "white"}) {
    EXPECT_EQ(refusal(path, text), path + ": is transparent all over: it shows nothing");
  }
}

TEST(Background, ADarkLogoOnBlackIsReadWithAHint) {
  const TempFolder folder;
  write_logo(folder / "a.png", 0.3F, 1.0F);
  EXPECT_THAT(read_image(folder / "a.png").changes,
              ElementsAre("transparency flattened onto black, and what is drawn is dark: "
                          "--background white shows it on white"));
  write_logo(folder / "a.png", 0.7F, 1.0F);
  EXPECT_THAT(read_image(folder / "a.png").changes,
              ElementsAre("transparency flattened onto black"));
}

using lensforge::testing::FullDisk;
using lensforge::testing::message_of;
using lensforge::testing::random_image;
using lensforge::testing::read_bytes;
using ::testing::AllOf;
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
