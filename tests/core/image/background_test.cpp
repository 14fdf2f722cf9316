// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/picture_refusal.h"
#include "core/image/transfer.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

using namespace lensforge::testing;
using OIIO::TypeDesc;
using ::testing::ElementsAre;
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
              "--background '" + text + "': must be black, white or #RRGGBB; #ffffff would do");
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

}  // namespace
}  // namespace lensforge
