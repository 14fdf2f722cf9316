// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/metadata_samples.h"
#include "core/image/rasters.h"
#include "core/stop_bound.h"
#include "core/temp_folder.h"
#include "core/test_images.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::random_image;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::HasSubstr;

/// A file of its own, so that there is something to name.
class PictureChild : public ::testing::Test {
 protected:
  PictureChild() { write_bytes(path_, "picture"); }

  std::string refusal(const std::function<std::string(RowSender&, const RunControl&)>& decode) {
    return message_of<InputError>([&] { decode_in_child(path_, decode, {}); });
  }

  TempFolder folder_;
  std::filesystem::path path_ = folder_ / "a.png";
};

TEST_F(PictureChild, RowsComeBackWhereTheyBelong) {
  constexpr int kColumns = 3001;
  constexpr int kRows = 700;
  const Image wanted = random_image(kColumns, kRows);
  const auto decode = [&](RowSender& sender, const RunControl&) {
    sender.begin(kColumns, kRows + 2, 0.25F);
    sender.send(301, wanted.values().subspan(300 * kColumns));
    sender.send(1, wanted.values().first(300 * kColumns));
    return std::string("all");
  };
  const DecodedPicture got = decode_in_child(path_, decode, {});
  EXPECT_EQ(got.text, "all");
  ASSERT_EQ(got.image.rows(), kRows + 2);
  const auto values = got.image.values();
  EXPECT_TRUE(std::ranges::equal(values.subspan(kColumns, kColumns * kRows), wanted.values()));
  for (int column = 0; column < kColumns; ++column) {
    ASSERT_EQ(got.image.at(column, 0), 0.25F);
    ASSERT_EQ(got.image.at(column, kRows + 1), 0.25F);
  }
}

TEST_F(PictureChild, ADecoderThatCrashesIsOneLineAboutTheFile) {
  const auto crash = [](RowSender& sender, const RunControl&) -> std::string {
    sender.begin(4, 4, 0.0F);
    std::raise(SIGSEGV);
    return {};
  };
  EXPECT_EQ(refusal(crash), path_.string() +
                                ": is no picture that can be read: its decoder crashed; save it "
                                "as PNG");
}

TEST_F(PictureChild, ADecoderThatComesToNoEndIsEnded) {
  const auto spin = [&](RowSender&, const RunControl&) -> std::string {
    limit_this_process({.memory_bytes = 0.0, .cpu_seconds = 1.0});
    for (volatile int i = 0; i >= 0;) i = (i + 1) % 1000;
    return {};
  };
  EXPECT_THAT(refusal(spin), HasSubstr("came to no end in the time that it was given"));
}

TEST_F(PictureChild, ADecoderThatHoardsMemoryIsEnded) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "with the address sanitizer, which maps terabytes, children have no limit";
#endif
  const auto hoard = [&](RowSender&, const RunControl&) -> std::string {
    limit_this_process({.memory_bytes = 2e8, .cpu_seconds = 0.0});
    std::vector<std::string> kept;
    while (kept.size() < 2000) kept.emplace_back(std::size_t{1} << 20, 'x');
    return {};
  };
  EXPECT_THAT(refusal(hoard), HasSubstr("its decoder "));
}

TEST_F(PictureChild, LimitsGrowWithThePictureAndItsFile) {
  const ChildLimits small = decoder_limits(path_, 1.0);
  const ChildLimits large = decoder_limits(path_, 16384.0 * 16384.0);
  EXPECT_LT(small.cpu_seconds, 60.0);
  EXPECT_GE(large.memory_bytes, small.memory_bytes);
  EXPECT_GT(large.cpu_seconds, small.cpu_seconds);
}

TEST_F(PictureChild, AStopEndsADecoderThatDoesNotLookForIt) {
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  const auto sleep = [](RowSender&, const RunControl&) {
    std::this_thread::sleep_for(std::chrono::seconds(60));
    return std::string();
  };
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THROW(decode_in_child(path_, sleep, control), Interrupted);
  EXPECT_LT(std::chrono::steady_clock::now() - start, lensforge::testing::kStopBound);
}

// A child that is forked while another thread holds a lock of OpenImageIO would wait forever.
TEST(PictureReader, PicturesAreReadWhileOtherThreadsWriteSome) {
  const TempFolder folder;
  const Image image = random_image(64, 64);
  write_image(image, folder / "a.exr");
  std::atomic<bool> done = false;
  std::vector<std::jthread> writers;
  writers.reserve(3);
  for (int i = 0; i < 3; ++i) {
    writers.emplace_back([&, i] {
      const std::string number = std::to_string(i);
      LayeredImage layers(64, 64, {"Z"});
      while (!done) {
        write_image(image, folder / ("w" + number + ".png"));
        write_layers(layers, folder / ("w" + number + ".exr"));
      }
    });
  }
  for (int i = 0; i < 60; ++i) EXPECT_EQ(read_image(folder / "a.exr").image, image);
  done = true;
}

// As Python's multiprocessing does.
TEST(PictureReader, AForkedProcessReadsPictures) {
  const TempFolder folder;
  const Image image = random_image(64, 64);
  write_image(image, folder / "a.exr");
  EXPECT_EQ(read_image(folder / "a.exr").image, image);
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(60);
    const bool same =
        read_image(folder / "a.exr").image == image && read_image(folder / "a.exr").image == image;
    write_image(image, folder / "b.exr");
    ::_exit(same ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST(PictureReader, ManyThreadsReadAtOnce) {
  const TempFolder folder;
  const Image image = random_image(64, 64);
  write_image(image, folder / "a.exr");
  std::vector<std::jthread> readers;
  readers.reserve(4);
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&] {
      for (int k = 0; k < 20; ++k) EXPECT_EQ(read_image(folder / "a.exr").image, image);
    });
  }
}

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
