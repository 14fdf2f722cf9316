// SPDX-License-Identifier: GPL-3.0-or-later
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/picture_refusal.h"
#include "core/sample_files.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::picture_refusal;
using lensforge::testing::pixel_spec;
using lensforge::testing::ramp;
using lensforge::testing::random_image;
using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using lensforge::testing::view;
using lensforge::testing::write_bytes;
using lensforge::testing::write_raw;
using OIIO::TypeDesc;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ImageIo, RefusesAMissingFile) {
  const TempFolder folder;
  EXPECT_THAT(picture_refusal(folder / "none.png"), HasSubstr("No such file or directory"));
}

TEST(ImageIo, RefusesAFolder) {
  const TempFolder folder;
  fs::create_directory(folder / "d.png");
  EXPECT_THAT(picture_refusal(folder / "d.png"), HasSubstr("is a folder"));
}

TEST(ImageIo, RefusesADevice) {
  EXPECT_THAT(picture_refusal("/dev/zero"), HasSubstr("only regular files are read"));
}

TEST(ImageIo, RefusesAnEmptyFile) {
  const TempFolder folder;
  write_bytes(folder / "e.png", "");
  EXPECT_THAT(picture_refusal(folder / "e.png"), HasSubstr("is empty"));
}

TEST(ImageIo, RefusesWhatIsNoPictureUnderAnyName) {
  const TempFolder folder;
  for (const char* name : {"t.png", "t.jpg", "t.tif", "t.exr", "t.txt", "t"}) {
    write_bytes(folder / name, "This is a letter and not a picture.\n");
    EXPECT_THAT(picture_refusal(folder / name), HasSubstr("is no picture that can be read"))
        << name;
  }
}

/// Cuts a written file at many places, also just before its end, and expects a refusal that prints
/// nothing.
void expect_every_cut_is_refused(const std::string& name, const OIIO::ImageSpec& spec,
                                 std::size_t tail) {
  const TempFolder folder;
  const Image values = random_image(spec.width * spec.nchannels, spec.height);
  const std::vector<float> pixels(values.values().begin(), values.values().end());
  write_raw(folder / name, spec, pixels);
  const std::string bytes = read_bytes(folder / name);
  ASSERT_EQ(read_image(folder / name).image.columns(), spec.width);
  ::testing::internal::CaptureStderr();
  for (int part = 1; part <= 30; ++part) {
    const std::size_t cut =
        part < 30 ? bytes.size() * static_cast<std::size_t>(part) / 30 : bytes.size() - tail;
    write_bytes(folder / name, std::string_view(bytes).substr(0, cut));
    EXPECT_THROW(read_image(folder / name), InputError) << name << " cut to " << cut;
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << name;
  EXPECT_EQ(OIIO::geterror(), "");
}

TEST(ImageIo, RefusesATruncatedPng) {
  expect_every_cut_is_refused("a.png", OIIO::ImageSpec(40, 30, 3, TypeDesc::UINT8), 1);
  expect_every_cut_is_refused("b.png", OIIO::ImageSpec(40, 30, 2, TypeDesc::UINT16), 12);
}

TEST(ImageIo, RefusesATruncatedJpeg) {
  expect_every_cut_is_refused("a.jpg", OIIO::ImageSpec(40, 30, 3, TypeDesc::UINT8), 1);
  OIIO::ImageSpec progressive(40, 30, 3, TypeDesc::UINT8);
  progressive.attribute("jpeg:progressive", 1);
  expect_every_cut_is_refused("b.jpg", progressive, 2);
}

TEST(ImageIo, RefusesATruncatedTiff) {
  for (const char* compression : {"none", "lzw", "zip"}) {
    OIIO::ImageSpec spec(40, 30, 3, TypeDesc::UINT8);
    spec.attribute("compression", compression);
    expect_every_cut_is_refused("a.tif", spec, 40);
  }
}

TEST(ImageIo, RefusesATruncatedExr) {
  expect_every_cut_is_refused("a.exr", OIIO::ImageSpec(40, 30, 3, TypeDesc::HALF), 1);
}

TEST(ImageIo, RefusesAPngWithADamagedChunk) {
  const TempFolder folder;
  OIIO::ImageSpec spec(40, 30, 1, TypeDesc::UINT8);
  write_raw(folder / "a.png", spec, ramp(spec));
  std::string bytes = read_bytes(folder / "a.png");
  bytes[bytes.size() / 2] = static_cast<char>(~bytes[bytes.size() / 2]);
  write_bytes(folder / "a.png", bytes);
  EXPECT_THAT(picture_refusal(folder / "a.png"), HasSubstr("is corrupt"));
}

TEST(ImageIo, RefusesThirtyThousandPixelsASideWithoutTheirMemory) {
  const TempFolder folder;
  write_bytes(folder / "h.png", view(lensforge::testing::kHugePng));
  // A progressive JPEG header: its decoder would allocate the whole picture on opening.
  write_bytes(folder / "h.jpg",
              std::string_view("\xff\xd8\xff\xc2\0\x0b\x08\x75\x30\x75\x30\x01\x01"
                               "\x11\0\xff\xd9",
                               17));
  for (const std::string name : {"h.tif", "h.exr"}) {
    OIIO::ImageSpec spec(30'000, 1, 1, TypeDesc::HALF);
    write_raw(folder / name, spec, std::vector<float>(30'000, 0.0F));
  }
  rusage before{};
  rusage after{};
  ::getrusage(RUSAGE_SELF, &before);
  for (const char* name : {"h.png", "h.jpg", "h.tif", "h.exr"}) {
    EXPECT_THAT(picture_refusal(folder / name),
                AllOf(HasSubstr("30000"), HasSubstr("at most 16384")));
  }
  ::getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100'000);
}

TEST(ImageIo, RefusesValuesThatAreNotFiniteOrFarBelowZeroNamingPixelAndValue) {
  const TempFolder folder;
  const float infinity = std::numeric_limits<float>::infinity();
  const std::vector<std::pair<float, std::string>> bad{
      {-0.25F,
       "must not be below 0; down to -0.15, three tenths of the largest, they are taken for 0"},
      {infinity, "must be finite"},
      {std::nanf(""), "must be finite"}};
  for (const auto& [value, rule] : bad) {
    OIIO::ImageSpec spec(4, 3, 3, TypeDesc::FLOAT);
    std::vector<float> pixels(36, 0.5F);
    pixels[3 * 6 + 1] = value;
    write_raw(folder / "v.exr", spec, pixels);
    EXPECT_THAT(picture_refusal(folder / "v.exr"),
                AllOf(HasSubstr("pixel (column 2, row 1) has the value "),
                      HasSubstr(" in channel G: values " + rule)));
  }
}

TEST(ImageIo, TakesTheRingingOfAFilterForBlackWithAMessage) {
  const TempFolder folder;
  const OIIO::ImageSpec spec(4, 3, 1, TypeDesc::FLOAT);
  std::vector<float> pixels(12, 0.5F);
  pixels[7] = -0.001F;
  write_raw(folder / "v.exr", spec, pixels);
  write_raw(folder / "v.tif", spec, pixels);
  std::string pfm = "Pf\n4 3\n-1.0\n";  // From the bottom up; row 1 is in the middle.
  pfm.append(reinterpret_cast<const char*>(pixels.data()), sizeof(float) * pixels.size());
  write_bytes(folder / "v.pfm", pfm);
  for (const char* name : {"v.exr", "v.tif", "v.pfm"}) {
    const LoadedImage loaded = read_image(folder / name);
    EXPECT_EQ(loaded.image.at(3, 1), 0.0F) << name;
    EXPECT_EQ(loaded.image.at(2, 1), 0.5F) << name;
    EXPECT_THAT(loaded.changes,
                ElementsAre("1 pixel with values below 0, the lowest -0.001, set to 0"))
        << name;
  }
}

/// Lanczos' filter with three lobes.
double lanczos(double x) {
  const auto sinc = [](double t) { return t == 0.0 ? 1.0 : std::sin(M_PI * t) / (M_PI * t); };
  return std::abs(x) < 3.0 ? sinc(x) * sinc(x / 3.0) : 0.0;
}

/// A row of black and white resampled between its pixels.
std::vector<float> sharpened(const std::vector<float>& row, std::size_t count) {
  std::vector<float> result;
  const double step = static_cast<double>(row.size() - 1) / static_cast<double>(count - 1);
  for (std::size_t i = 0; i < count; ++i) {
    const double place = step * static_cast<double>(i);
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const double weight = lanczos(place - static_cast<double>(k));
      sum += weight * static_cast<double>(row[k]);
      weights += weight;
    }
    result.push_back(static_cast<float>(sum / weights));
  }
  return result;
}

TEST(ImageIo, ReadsWhateverASharpeningFilterMakesOfBlackAndWhite) {
  const TempFolder folder;
  std::mt19937 random(3);
  for (int run = 0; run < 40; ++run) {
    std::vector<float> row(1, 1.0F);
    while (row.size() < 40) row.push_back(random() % (run % 2 == 0 ? 2 : 8) == 0 ? 1.0F : 0.0F);
    write_raw(folder / "v.exr", OIIO::ImageSpec(311, 1, 1, TypeDesc::FLOAT), sharpened(row, 311));
    const auto values = read_image(folder / "v.exr").image;
    EXPECT_GE(*std::ranges::min_element(values.values()), 0.0F);
  }
}

TEST(ImageIo, RefusesAnAlphaThatIsNotFinite) {
  const TempFolder folder;
  write_raw(folder / "v.exr", pixel_spec(4, TypeDesc::FLOAT), {0.F, 0.F, 0.F, std::nanf("")});
  EXPECT_THAT(picture_refusal(folder / "v.exr"), HasSubstr("in channel A"));
}

}  // namespace
}  // namespace lensforge
