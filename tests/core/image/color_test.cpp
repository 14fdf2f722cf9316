// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/color.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "core/image/image_io.h"
#include "core/image/metadata_samples.h"
#include "core/image/picture_codec.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

TEST(Transfer, BlackAndWhiteStay) {
  EXPECT_EQ(encode(0.0), 0.0);
  EXPECT_DOUBLE_EQ(encode(1.0), 1.0);
  EXPECT_DOUBLE_EQ(decode(1.0), 1.0);
}

TEST(Transfer, MiddleGreyIsTheStandardsFigure) {
  // IEC 61966-2-1: code 128 of 255 is 21.586 % light.
  EXPECT_NEAR(decode(128.0 / 255.0), 0.215861, 1e-6);
}

TEST(Transfer, DecodeUndoesEncode) {
  for (int i = 0; i <= 2000; ++i) {
    const double linear = i / 1000.0;
    EXPECT_NEAR(decode(encode(linear)), linear, 1e-7);
  }
}

TEST(Transfer, SlopeAgreesWithCentralDifferences) {
  for (const double linear : {1e-4, 0.003, 0.0032, 0.01, 0.3, 1.0, 1.7}) {
    for (const double step : {1e-6 * linear, 5e-7 * linear}) {
      const double slope = (encode(linear + step) - encode(linear - step)) / (2.0 * step);
      EXPECT_NEAR(encode_slope(linear), slope, 1e-8 * slope + 1e-9);
    }
  }
}

TEST(Transfer, IsOddBelowZeroInsideTheToe) { EXPECT_EQ(encode(-0.002), -encode(0.002)); }

using Curve = ColorSpace::Curve;

TEST(ColorSpace, KnowsOpenImageIoNamesInAnyCase) {
  EXPECT_EQ(parse_color_space("sRGB")->curve, Curve::kSrgb);
  EXPECT_EQ(parse_color_space("linear")->curve, Curve::kLinear);
  EXPECT_EQ(parse_color_space("Linear")->curve, Curve::kLinear);
  EXPECT_EQ(parse_color_space("scene_linear")->curve, Curve::kLinear);
  EXPECT_EQ(parse_color_space("Rec709")->curve, Curve::kRec709);
  EXPECT_EQ(*parse_color_space("Gamma2.2"), (ColorSpace{Curve::kGamma, 2.2}));
  EXPECT_EQ(*parse_color_space("GammaCorrected1.8"), (ColorSpace{Curve::kGamma, 1.8}));
  EXPECT_EQ(parse_color_space("Gamma1.0")->curve, Curve::kLinear);
}

TEST(ColorSpace, OtherNamesAreUnknown) {
  for (const char* name : {"", "AdobeRGB", "Gamma", "Gammax", "Gamma2.2x", "Gamma-1", "Gamma0"}) {
    EXPECT_FALSE(parse_color_space(name).has_value()) << name;
  }
}

TEST(ColorSpace, EveryCurveKeepsBlackAndWhite) {
  for (const ColorSpace& space :
       {ColorSpace{Curve::kLinear, 1.0}, ColorSpace{Curve::kSrgb, 1.0},
        ColorSpace{Curve::kRec709, 1.0}, ColorSpace{Curve::kGamma, 2.2}}) {
    EXPECT_EQ(to_linear(0.0, space), 0.0);
    EXPECT_NEAR(to_linear(1.0, space), 1.0, 1e-12);
  }
}

TEST(ColorSpace, CurvesFollowTheirStandards) {
  EXPECT_EQ(to_linear(0.5, {Curve::kLinear, 1.0}), 0.5);
  EXPECT_EQ(to_linear(0.5, {Curve::kSrgb, 1.0}), decode(0.5));
  EXPECT_DOUBLE_EQ(to_linear(0.5, {Curve::kGamma, 2.2}), std::pow(0.5, 2.2));
  // BT.709: V = 1.099 L^0.45 − 0.099, and 4.5 L below L = 0.018.
  EXPECT_NEAR(to_linear(1.099 * std::pow(0.3, 0.45) - 0.099, {Curve::kRec709, 1.0}), 0.3, 1e-12);
  EXPECT_NEAR(to_linear(0.045, {Curve::kRec709, 1.0}), 0.01, 1e-12);
}

using namespace lensforge::testing;
using OIIO::TypeDesc;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
    const std::size_t at = 2 * static_cast<std::size_t>(c);
    const double x = xy[at];
    const double y = xy[at + 1];
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
  std::vector<float> stored(256 * 3);
  std::mt19937 random(6);
  for (float& value : stored) value = static_cast<float>(random() % 256) / 255.0F;
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

TEST(SpectralColor, MatchesTheTablesOfCie1931) {
  // CIE 1931 2° observer.
  const struct {
    double nm;
    Eigen::Vector3d xyz;
  } table[] = {{450.0, {0.3362, 0.0380, 1.7721}},
               {500.0, {0.0049, 0.3230, 0.2720}},
               {550.0, {0.4334, 0.9950, 0.0087}},
               {600.0, {1.0622, 0.6310, 0.0008}},
               {650.0, {0.2835, 0.1070, 0.0000}}};
  for (const auto& row : table) {
    EXPECT_LT((color_matching(row.nm) - row.xyz).cwiseAbs().maxCoeff(), 0.03) << row.nm;
  }
}

TEST(SpectralColor, BrightnessSumsToOneAndIsMostlyGreen) {
  const std::vector<double> shares = brightness_shares({450.0, 550.0, 650.0});
  EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1.0, 1e-15);
  EXPECT_GT(shares[1], 0.8);
}

TEST(SpectralColor, AllWavelengthsTogetherAreWhiteAndEachAloneIsItsColour) {
  const std::vector<double> wavelengths{450.0, 550.0, 620.0};
  const Image on(1, 1, 1.0F);
  const Image off(1, 1, 0.0F);
  EXPECT_EQ(color_picture({on, on, on}, wavelengths).rgb,
            (std::vector<unsigned char>{255, 255, 255}));
  const std::vector<unsigned char> blue = color_picture({on, off, off}, wavelengths).rgb;
  EXPECT_GT(blue[2], 200);
  EXPECT_LT(blue[1], 60);
  const std::vector<unsigned char> red = color_picture({off, off, on}, wavelengths).rgb;
  EXPECT_GT(red[0], 200);
  EXPECT_LT(red[2], 60);
}

std::array<Image, 3> one_pixel(const Eigen::Vector3d& rgb) {
  std::array<Image, 3> picture;
  for (std::size_t k = 0; k < 3; ++k) {
    picture[k] = Image(1, 1, static_cast<float>(rgb[static_cast<int>(k)]));
  }
  return picture;
}

constexpr std::array<double, 3> kLamps{625.0, 525.0, 465.0};

TEST(ThreeLamps, TogetherHaveThePicturesColours) {
  // Colours from white to those that the lamps still reach.
  for (const Eigen::Vector3d& rgb :
       {Eigen::Vector3d(1.0, 1.0, 1.0), Eigen::Vector3d(0.5, 0.5, 0.5),
        Eigen::Vector3d(0.8, 0.3, 0.2), Eigen::Vector3d(0.2, 0.6, 0.3),
        Eigen::Vector3d(0.2, 0.3, 0.7), Eigen::Vector3d(0.0, 0.0, 0.0)}) {
    const LampSplit split = split_by_lamps(one_pixel(rgb), kLamps);
    EXPECT_EQ(split.outside, 0.0) << rgb.transpose();
    const std::vector<float> wanted = tristimulus(one_pixel(rgb));
    const std::vector<float> reached = tristimulus(split.lamps);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(reached[k], wanted[k], 1e-6) << rgb.transpose();
  }
}

TEST(ThreeLamps, WhiteIsAllOfEachAndItsLuminanceTheirSum) {
  const LampSplit split = split_by_lamps(one_pixel(Eigen::Vector3d::Ones()), kLamps);
  double luminance = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(split.lamps.pictures[k].at(0, 0), 1.0, 1e-6);
    luminance += split.lamps.brightness[k];
  }
  EXPECT_NEAR(luminance, 1.0, 1e-4);  // The standard's matrices have four digits.
}

TEST(ThreeLamps, AColourBeyondTheirTriangleIsToldAndItsPictureStaysPossible) {
  const std::array<double, 3> pale{600.0, 550.0, 480.0};
  const LampSplit split = split_by_lamps(one_pixel({0.0, 0.0, 1.0}), pale);
  EXPECT_EQ(split.outside, 1.0);
  for (const Image& picture : split.lamps.pictures) {
    EXPECT_GE(picture.at(0, 0), 0.0F);
    EXPECT_LE(picture.at(0, 0), 1.0F);
  }
}

TEST(ThreeLamps, MixWhiteOnlyIfItLiesBetweenThem) {
  EXPECT_TRUE(lamps_mix_white(kLamps));
  EXPECT_TRUE(lamps_mix_white({638.0, 520.0, 450.0}));
  EXPECT_FALSE(lamps_mix_white({700.0, 650.0, 600.0}));
  EXPECT_FALSE(lamps_mix_white({625.0, 625.0, 465.0}));
  EXPECT_FALSE(lamps_mix_white({540.0, 525.0, 465.0}));
}

/// CIE L*a*b* under D65 (CIE 15:2004, inverted).
std::vector<float> xyz_of_lab(double l, double a, double b) {
  const auto inverse = [](double t) {
    return t > 6.0 / 29.0 ? t * t * t : 3.0 * (6.0 / 29.0) * (6.0 / 29.0) * (t - 4.0 / 29.0);
  };
  const double y = (l + 16.0) / 116.0;
  return {static_cast<float>(0.95047 * inverse(y + a / 500.0)), static_cast<float>(inverse(y)),
          static_cast<float>(1.08883 * inverse(y - b / 200.0))};
}

TEST(ColorDifference, HasTheValuesThatItsAuthorsPublished) {
  // Sharma, Wu and Dalal 2005, table 1: pairs 1, 7, 14, 17 and 25.
  const struct {
    std::array<double, 3> first, second;
    double difference;
  } pairs[] = {{{50.0, 2.6772, -79.7751}, {50.0, 0.0, -82.7485}, 2.0425},
               {{50.0, 0.0, 0.0}, {50.0, -1.0, 2.0}, 2.3669},
               {{50.0, -0.0010, 2.4900}, {50.0, 0.0011, -2.4900}, 4.7461},
               {{50.0, 2.5, 0.0}, {73.0, 25.0, -18.0}, 27.1492},
               {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644}};
  for (const auto& pair : pairs) {
    const auto [l, a, b] = pair.first;
    const auto [m, c, d] = pair.second;
    EXPECT_NEAR(color_differences(xyz_of_lab(l, a, b), xyz_of_lab(m, c, d)).at(0), pair.difference,
                2e-3);
  }
}

}  // namespace

}  // namespace lensforge
