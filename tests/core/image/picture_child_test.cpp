// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/picture_codec.h"
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
                                ": is no picture that can be read: its decoder crashed; saved anew "
                                "as PNG it would do");
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
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&] {
      for (int k = 0; k < 20; ++k) EXPECT_EQ(read_image(folder / "a.exr").image, image);
    });
  }
}

}  // namespace
}  // namespace lensforge
