// SPDX-License-Identifier: GPL-3.0-or-later
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <random>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/picture_refusal.h"
#include "core/io/lens_folder.h"
#include "core/sample_files.h"
#include "core/temp_folder.h"
#include "core/test_images.h"
#include "core/text/words.h"

namespace lensforge::image_refusal_test {
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

using lensforge::testing::png_chunk;

std::string refusal_of(std::string_view bytes) {
  const TempFolder folder;
  write_bytes(folder / "p", bytes);
  return picture_refusal(folder / "p");
}

OIIO::ImageSpec small_spec() { return OIIO::ImageSpec(13, 9, 3, TypeDesc::UINT8); }

TEST(PictureReader, FormatsWhoseDecodersCrashAreRefusedUnopened) {
  const TempFolder folder;
  for (const std::string name : {"a.ico", "a.sgi", "a.dpx", "a.tga"}) {
    write_raw(folder / name, small_spec(), ramp(small_spec()));
    EXPECT_THAT(picture_refusal(folder / name),
                AllOf(HasSubstr("is no picture that can be read"), HasSubstr("PNG, JPEG, TIFF")));
  }
}

TEST(PictureReader, AQuestionMarkInANameIsPartOfTheName) {
  const TempFolder folder;
  const Image image = random_image(6, 4);
  for (const std::string name : {"a?b=1.png", "what?.exr", "?.png"}) {
    write_image(image, folder / name);
    EXPECT_EQ(read_image(folder / name).image.columns(), 6) << name;
  }
  for (const std::string extension : {".jpg", ".tif", ".gif", ".webp", ".bmp", ".ppm", ".hdr"}) {
    write_raw(folder / ("a" + extension), small_spec(), ramp(small_spec()));
    fs::rename(folder / ("a" + extension), folder / ("a?x=y" + extension));
    EXPECT_EQ(read_image(folder / ("a?x=y" + extension)).image.columns(), 13) << extension;
  }
}

TEST(PictureReader, ANamedPipeIsRefusedWithoutWaiting) {
  const TempFolder folder;
  ASSERT_EQ(::mkfifo((folder / "p.png").c_str(), 0600), 0);
  EXPECT_THAT(picture_refusal(folder / "p.png"), HasSubstr("named pipe"));
}

TEST(PictureReader, SizesAreRefusedBeforeADecoderTakesMemoryForThem) {
  const std::string_view gif("GIF89a\xff\xff\xff\xff\0\0\0", 13);
  const std::string_view bmp(
      "BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\0\0\1\0\0\0\1\0\1\0\x18\0\0\0\0\0", 34);
  const std::string_view webp("RIFF\0\0\0\0WEBPVP8X\n\0\0\0\0\0\0\0\xff\xff\xff\xff\xff\xff", 30);
  const std::string_view heif(
      "\0\0\0\x18"
      "ftypheic\0\0\0\0ispe\0\0\0\0\0\0\xff\xff\0\0\xff\xff",
      32);
  std::string exr("\x76\x2f\x31\x01\2\0\0\0", 8);
  exr += std::string("dataWindow\0box2i\0\x10\0\0\0\0\0\0\0\0\0\0\0\1\0\0\0\xff\xff\xff\x7f", 37);
  for (const std::string_view bytes : {gif, bmp, webp, heif, std::string_view(exr)}) {
    EXPECT_THAT(refusal_of(bytes), HasSubstr("pixels: at most 16384 a side are read"));
  }
}

TEST(PictureReader, APictureThatDoesNotFitTheMemoryIsRefusedWithItsNeed) {
  const TempFolder folder;
  const OIIO::ImageSpec spec(16384, 16384, 1, TypeDesc::UINT8);
  std::string gif("GIF89a\0\x40\0\x40\0\0\0", 13);
  write_bytes(folder / "g.gif", gif);
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit limit{rlim_t{700} << 20U, rlim_t{700} << 20U};
    ::setrlimit(RLIMIT_AS, &limit);
    try {
      read_image(folder / "g.gif");
    } catch (const InputError& error) {
      ::_exit(std::string_view(error.what()).find("GB of memory") == std::string_view::npos ? 1
                                                                                            : 0);
    }
    ::_exit(2);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST(PictureReader, APgmThatBreaksItsMaximumIsRefused) {
  EXPECT_THAT(refusal_of(std::string_view("P5 2 2 0\n\0\0\0\0", 13)), HasSubstr("a maximum of 0"));
  EXPECT_THAT(refusal_of("P5 2 2 70000\n        "), HasSubstr("a maximum of 70000"));
  EXPECT_THAT(refusal_of("P5 2 2 10\n\1\2\3\x0b"), HasSubstr("row 1 has the value 11"));
  EXPECT_THAT(refusal_of("P2 2 2 10\n1 2 3 11\n"), HasSubstr("row 1 has the value 11"));
  EXPECT_THAT(refusal_of("P2 2 2 10\n1 2 3\n"), HasSubstr("data end in row 1 of 2"));
  EXPECT_THAT(refusal_of("P2 2 2 10\n1 2 x 4\n"), HasSubstr("no number"));
  EXPECT_THAT(refusal_of("P6 2 2 255\n123"), HasSubstr("data end in row 0 of 2"));
  EXPECT_THAT(refusal_of("P5 -2 2 255\n"), HasSubstr("no size"));
}

TEST(PictureReader, EveryKindOfPnmIsRead) {
  const TempFolder folder;
  const std::vector<std::string> pictures{"P1 # bits\n2 1\n1 0\n",
                                          "P2\n2 1\n7\n0 7\n",
                                          "P3\n2 1 7\n0 0 0 7 7 7\n",
                                          std::string("P4\n2 1\n\x80"),
                                          std::string("P5\n2 1\n7\n\0\7", 11),
                                          std::string("P5\n2 1\n300\n\0\0\1\x2c", 15),
                                          std::string("P6\n2 1\n255\n\0\0\0\377\377\377", 17)};
  for (const std::string& picture : pictures) {
    write_bytes(folder / "p", picture);
    const Image image = read_image(folder / "p").image;
    EXPECT_EQ(image.at(0, 0), 0.0F) << picture;
    EXPECT_EQ(image.at(1, 0), 1.0F) << picture;
  }
}

TEST(PictureReader, AnAnimatedPngIsReadWithANote) {
  const TempFolder folder;
  write_raw(folder / "a.png", pixel_spec(1, TypeDesc::UINT8), {1.0F});
  std::string bytes = read_bytes(folder / "a.png");
  bytes.insert(33, png_chunk("acTL", std::string("\0\0\0\2\0\0\0\0", 8)));
  write_bytes(folder / "a.png", bytes);
  EXPECT_THAT(read_image(folder / "a.png").changes,
              ElementsAre("animated: only the first frame read"));
}

TEST(PictureReader, WhatDecodersPrintAndWhatFilesNameStaysOffTheTerminal) {
  const TempFolder folder;
  OIIO::ImageSpec spec(64, 64, 1, TypeDesc::UINT8);
  write_raw(folder / "a.png", spec, ramp(spec));
  const std::string bytes = read_bytes(folder / "a.png");
  const std::string head = bytes.substr(0, 33);
  // Chunks that are whole, around data that are not.
  write_bytes(folder / "b.png",
              head + png_chunk("IDAT", "this is no zlib stream") + png_chunk("IEND", ""));
  write_bytes(folder / "c.png",
              head.substr(0, 8) +
                  png_chunk("IHDR", std::string("\0\0\0\1\0\0\0\1\x63\x07\0\0\0", 13)) +
                  png_chunk("IEND", ""));
  ::testing::internal::CaptureStderr();
  for (const char* name : {"b.png", "c.png"}) {
    EXPECT_LT(picture_refusal(folder / name).size(), 400U);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  std::string profile(300, 'x');
  profile[0] = '\x1b';
  write_bytes(folder / "d.png",
              std::string(bytes).insert(33, png_chunk("iCCP", profile + '\0' + '\0' + "x")));
  const LoadedImage loaded = read_image(folder / "d.png");
  ASSERT_EQ(loaded.changes.size(), 1U);
  EXPECT_EQ(printable_line(loaded.changes[0], 130), loaded.changes[0]);
}

TEST(PictureReader, WhatDecodersSayToProgrammersIsLeftOut) {
  const TempFolder folder;
  OIIO::ImageSpec spec = small_spec();
  spec.attribute("compression", "lzw");
  write_raw(folder / "a.tif", spec, ramp(spec));
  std::string bytes = read_bytes(folder / "a.tif");
  // Tag 273 has the place of the only strip.
  const std::size_t entry = bytes.find(std::string_view("\x11\x01\x04\0\x01\0\0\0", 8));
  ASSERT_NE(entry, std::string::npos);
  const auto strip =
      static_cast<std::ptrdiff_t>(static_cast<unsigned char>(bytes[entry + 8]) +
                                  256 * static_cast<unsigned char>(bytes[entry + 9]));
  std::fill_n(bytes.begin() + strip, 20, '\xff');
  write_bytes(folder / "a.tif", bytes);
  const std::string path = (folder / "a.tif").string();
  EXPECT_EQ(picture_refusal(path), path + ": is truncated or corrupt");
}

TEST(PictureReader, ATiffOfAnUnknownCompressionIsRefusedByItsNumber) {
  const TempFolder folder;
  write_raw(folder / "a.tif", small_spec(), ramp(small_spec()));
  std::string bytes = read_bytes(folder / "a.tif");
  const std::string_view entry("\x03\x01\x03\0\x01\0\0\0", 8);  // Tag 259, one SHORT.
  const std::size_t at = bytes.find(entry);
  ASSERT_NE(at, std::string::npos);
  bytes[at + entry.size()] = '\x88';
  bytes[at + entry.size() + 1] = '\0';
  write_bytes(folder / "a.tif", bytes);
  EXPECT_THAT(picture_refusal(folder / "a.tif"),
              HasSubstr(": its TIFF compression 136 cannot be read: save it as PNG"));
}

TEST(PictureReader, AStopEndsReadingAndResamplingAtOnceAndProgressIsReported) {
  const TempFolder folder;
  write_image(random_image(300, 200), folder / "a.png");
  std::vector<std::string> stages;
  const auto sink = [&](const Progress& progress) { stages.push_back(progress.stage); };
  const Image image = read_image(folder / "a.png", {{}, sink}).image;
  resample(image, 10, 10, {{}, sink});
  EXPECT_EQ(stages.front(), "reading picture");
  EXPECT_EQ(stages.back(), "resampling picture");
  std::stop_source stop;
  stop.request_stop();
  const RunControl run(stop.get_token(), {});
  EXPECT_THROW(read_image(folder / "a.png", run), Interrupted);
  EXPECT_THROW(resample(image, 10, 10, run), Interrupted);
}

TEST(PictureReader, AStopWhileADecoderReadsAWholeFileEndsIt) {
  const TempFolder folder;
  OIIO::ImageSpec spec(2000, 2000, 3, TypeDesc::UINT8);
  spec.attribute("jpeg:progressive", 1);
  write_raw(folder / "a.jpg", spec, ramp(spec));
  std::stop_source stop;
  // Its stop comes with the first row that is asked for, so the decoder is at work.
  const RunControl run(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  EXPECT_THROW(read_image(folder / "a.jpg", run), Interrupted);
}

TEST(PictureWriter, PicturesSayWhoWroteThem) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.exr"}) {
    write_image(random_image(500, 400), folder / name);
    EXPECT_TRUE(written_by_lensforge(folder / name)) << name;
  }
  write_image(ColorImage{1, 1, {1, 2, 3}}, folder / "c.png");
  EXPECT_TRUE(written_by_lensforge(folder / "c.png"));
}

/// One to four random changes, mostly near the front, where the headers are.
std::string mutated(std::string bytes, std::mt19937_64& random) {
  constexpr std::array<char, 5> kExtremes{'\0', '\xff', '\x7f', '\x80', '\1'};
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  for (std::size_t change = 1 + below(4); change > 0 && !bytes.empty(); --change) {
    const std::size_t at =
        below(below(3) > 0 ? std::min<std::size_t>(bytes.size(), 200) : bytes.size());
    switch (below(4)) {
      case 0:
        bytes[at] = static_cast<char>(random());
        break;
      case 1:
        bytes.erase(at, below(8));
        break;
      case 2:
        bytes.resize(at);
        break;
      default:
        bytes[at] = kExtremes[below(kExtremes.size())];
        break;
    }
  }
  return bytes;
}

TEST(PictureReader, EveryMutantIsAPictureOrOnePrintableLine) {
  const TempFolder folder;
  std::vector<std::string> seeds;
  for (const std::string name :
       {"a.png", "a.jpg", "a.tif", "a.exr", "a.hdr", "a.ppm", "a.bmp", "a.gif", "a.webp"}) {
    write_raw(folder / name, small_spec(), ramp(small_spec()));
    seeds.push_back(read_bytes(folder / name));
  }
  std::mt19937_64 random(17);
  ::testing::internal::CaptureStderr();
  for (std::size_t run = 0; run < 270; ++run) {
    write_bytes(folder / "m", mutated(seeds[run % seeds.size()], random));
    try {
      EXPECT_FALSE(read_image(folder / "m").image.empty());
    } catch (const InputError& error) {
      EXPECT_EQ(printable_line(error.what(), 400), error.what());
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace

}  // namespace lensforge::image_refusal_test
