// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "core/image/rasters.h"
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

}  // namespace
}  // namespace lensforge
