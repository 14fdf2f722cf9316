// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/metadata_samples.h"
#include "core/image/transfer.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

using namespace lensforge::testing;
using OIIO::TypeDesc;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::span<const unsigned char> bytes_of(const std::string& text) {
  return {reinterpret_cast<const unsigned char*>(text.data()), text.size()};
}

double light(const std::string& profile, const std::array<double, 3>& stored) {
  return ColorProfile::open(bytes_of(profile)).value().light(stored);
}

/// Writes a picture with the profile, where the format's writer of OpenImageIO keeps it.
LoadedImage read_with(const std::string& profile, const std::string& extension,
                      OIIO::ImageSpec spec, const std::vector<float>& stored) {
  const TempFolder folder;
  if (!profile.empty()) set_profile(spec, profile);
  write_raw(folder / ("a" + extension), spec, stored);
  return read_image(folder / ("a" + extension));
}

TEST(ColorProfile, GammaOfAGreyProfileIsAPower) {
  const std::string profile = grey_profile(2.2);
  for (int i = 0; i <= 20; ++i) {
    EXPECT_NEAR(light(profile, {i / 20.0, 0.0, 0.0}), std::pow(i / 20.0, 2.2), 2e-5);
  }
}

TEST(ColorProfile, ALinearProfileOfRec709sPrimariesIsTheirLuminance) {
  const std::string profile = rgb_profile(1.0, kRec709Primaries);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform;
  for (int i = 0; i < 50; ++i) {
    const std::array<double, 3> rgb{uniform(random), uniform(random), uniform(random)};
    EXPECT_NEAR(light(profile, rgb), luminance_rec709(rgb), 1e-4);
  }
}

/// Luminance of primaries by chromaticity, of D65: the middle row of the matrix from RGB to XYZ.
std::array<double, 3> luminances(const std::array<double, 6>& xy) {
  Eigen::Matrix3d primaries;
  for (int c = 0; c < 3; ++c) {
    const double x = xy[static_cast<std::size_t>(2 * c)];
    const double y = xy[static_cast<std::size_t>(2 * c + 1)];
    primaries.col(c) << x / y, 1.0, (1.0 - x - y) / y;
  }
  const Eigen::Vector3d white(0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290);
  const Eigen::Vector3d weights = primaries.inverse() * white;
  return {weights[0], weights[1], weights[2]};
}

TEST(ColorProfile, WiderPrimariesHaveTheLuminanceOfTheirChromaticities) {
  const std::array<double, 3> weights = luminances(kAdobePrimaries);
  const std::string profile = rgb_profile(2.19921875, kAdobePrimaries);
  for (std::size_t c = 0; c < 3; ++c) {
    std::array<double, 3> stored{};
    stored[c] = 0.7;
    EXPECT_NEAR(light(profile, stored), weights[c] * std::pow(0.7, 2.19921875), 2e-4) << c;
  }
  EXPECT_DOUBLE_EQ(light(profile, {1.0, 1.0, 1.0}), 1.0);
}

TEST(ColorProfile, TablesGiveWhatTheProfileGives) {
  const std::string profile = rgb_profile(1.8, kAdobePrimaries);
  ColorProfile table = ColorProfile::open(bytes_of(profile)).value();
  table.tabulate(255);
  std::mt19937 random(4);
  for (int i = 0; i < 200; ++i) {
    const auto value = [&] { return static_cast<double>(random() % 256) / 255.0; };
    const std::array<double, 3> stored{value(), value(), value()};
    EXPECT_NEAR(table.light(stored), light(profile, stored), 1e-7);
  }
}

TEST(ColorProfile, EveryFormatsProfileIsAppliedWithAMessage) {
  const std::string rgb = rgb_profile(1.8, kRec709Primaries);
  const OIIO::ImageSpec spec(16, 16, 3, TypeDesc::UINT8);
  const std::vector<float> stored(16 * 16 * 3, 0.5F);
  const std::string said = "embedded colour profile '" + std::string(kProfileName) + "' applied";
  for (const std::string extension : {".png", ".jpg", ".tif"}) {
    const LoadedImage loaded = read_with(rgb, extension, spec, stored);
    EXPECT_NEAR(loaded.image.at(8, 8), std::pow(128.0 / 255.0, 1.8), 2e-4) << extension;
    EXPECT_THAT(loaded.changes, ElementsAre(said)) << extension;
  }
  const TempFolder folder;
  write_webp(folder / "a.webp", spec, stored, {.profile = rgb, .exif = {}});
  write_heic(folder / "a.heic", 64, 64, {.profile = rgb, .exif = {}, .turned = false});
  write_bmp_with_profile(folder / "a.bmp", rgb);
  for (const char* name : {"a.webp", "a.heic", "a.bmp"}) {
    const LoadedImage loaded = read_image(folder / name);
    EXPECT_NEAR(loaded.image.at(1, 0), std::pow(128.0 / 255.0, 1.8), 0.01) << name;
    EXPECT_THAT(loaded.changes, Contains(said)) << name;
  }
}

TEST(ColorProfile, GreyAndDeepPicturesGoByTheirProfiles) {
  for (const auto type : {TypeDesc::UINT8, TypeDesc::UINT16}) {
    const LoadedImage loaded = read_with(grey_profile(2.2), ".png", pixel_spec(1, type), {0.4F});
    EXPECT_NEAR(loaded.image.at(0, 0), std::pow(0.4, 2.2), 1e-4);
  }
  const LoadedImage floats =
      read_with(grey_profile(2.2), ".tif", pixel_spec(1, TypeDesc::FLOAT), {0.4F});
  EXPECT_NEAR(floats.image.at(0, 0), std::pow(0.4, 2.2), 1e-4);
  const LoadedImage alpha =
      read_with(grey_profile(2.2), ".png", pixel_spec(2, TypeDesc::UINT16), {0.4F, 0.5F});
  EXPECT_NEAR(alpha.image.at(0, 0), 0.5 * std::pow(0.4, 2.2), 1e-4);
}

TEST(ColorProfile, AProfileOfSrgbChangesNoBit) {
  const OIIO::ImageSpec spec(256, 1, 3, TypeDesc::UINT8);
  std::vector<float> stored;
  std::mt19937 random(6);
  for (int i = 0; i < 256 * 3; ++i) stored.push_back(static_cast<float>(random() % 256) / 255.0F);
  const LoadedImage plain = read_with("", ".png", spec, stored);
  const LoadedImage with = read_with(srgb_profile(), ".png", spec, stored);
  EXPECT_EQ(with.image, plain.image);
  EXPECT_EQ(with.changes, plain.changes);
  EXPECT_FALSE(ColorProfile::open(bytes_of(rgb_profile(2.2, kRec709Primaries)))->is_srgb());
}

TEST(ColorProfile, ABrokenProfileIsNamedAndThePictureReadAsSrgb) {
  const OIIO::ImageSpec spec(2, 1, 3, TypeDesc::UINT8);
  const std::vector<float> stored{0.5F, 0.5F, 0.5F, 1.0F, 1.0F, 1.0F};
  const std::string good = rgb_profile(1.8, kRec709Primaries);
  std::string tagless = good.substr(0, 128) + std::string(4, '\0');
  for (const std::string& profile : {std::string("no profile"), good.substr(0, 300), tagless}) {
    for (const std::string extension : {".jpg", ".tif"}) {
      const LoadedImage loaded = read_with(profile, extension, spec, stored);
      EXPECT_NEAR(loaded.image.at(0, 0), decode(0.5), 0.02) << extension;
      EXPECT_THAT(loaded.changes, Contains(HasSubstr("is broken: read as sRGB"))) << extension;
    }
  }
  EXPECT_THAT(read_with(cmyk_profile(), ".jpg", spec, stored).changes,
              Contains(HasSubstr("is of CMYK values: read as sRGB")));
}

TEST(ColorProfile, NoBytesOfAProfileCrashTheReader) {
  const OIIO::ImageSpec spec(2, 1, 3, TypeDesc::UINT8);
  std::mt19937 random(8);
  const TempFolder folder;
  for (int run = 0; run < 60; ++run) {
    std::string profile = rgb_profile(1.8, kAdobePrimaries);
    for (int i = 0; i < 4; ++i) profile[random() % profile.size()] = static_cast<char>(random());
    write_webp(folder / "a.webp", spec, {0.5F, 0.5F, 0.5F, 1.0F, 1.0F, 1.0F},
               {.profile = profile, .exif = {}});
    EXPECT_FALSE(read_image(folder / "a.webp").image.empty());
  }
}

}  // namespace
}  // namespace lensforge
