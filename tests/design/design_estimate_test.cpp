// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <string>
#include <string_view>

#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using ::testing::ExitedWithCode;
using ::testing::HasSubstr;

std::string refusal_of(const DesignOptions& options) {
  return testing::message_of<InputError>(
      [&] { require_room_for_design(16384, 16384, options, 1, "/"); });
}

TEST(DesignEstimate, IsNearTheMeasuredDesigns) {
  // The 512² portrait as facets: 973 processor seconds and 1.8 GB; at 128²: 57 s.
  DesignOptions options;
  options.pixels = 512;
  const WorkEstimate large = estimate_design(512, 512, options, 1);
  EXPECT_GT(large.seconds, 973.0 / 2.0);
  EXPECT_LT(large.seconds, 973.0 * 2.0);
  EXPECT_GT(large.memory_bytes, 1.8e9 / 1.5);
  EXPECT_LT(large.memory_bytes, 1.8e9 * 1.5);
  options.pixels = 128;
  const WorkEstimate small = estimate_design(512, 512, options, 1);
  EXPECT_GT(small.seconds, 57.0 / 2.0);
  EXPECT_LT(small.seconds, 57.0 * 2.0);
}

TEST(DesignEstimate, ThreadsShareTheTimeAndEffortAddsToIt) {
  DesignOptions options;
  const double one = estimate_design(512, 512, options, 1).seconds;
  EXPECT_DOUBLE_EQ(estimate_design(512, 512, options, 2).seconds, 0.5 * one);
  options.rounds *= 2;
  EXPECT_GT(estimate_design(512, 512, options, 1).seconds, 1.5 * one);
}

TEST(DesignEstimate, TheAdvisedPixelsFit) {
  DesignOptions options;
  options.mesh_ratio = 8.0;  // 70 TB.
  options.pixels = 16384;
  const std::string refusal = refusal_of(options);
  ASSERT_THAT(refusal, HasSubstr("would fit"));
  const std::string advice = refusal.substr(refusal.rfind("--pixels ") + 9);
  options.pixels = std::stoi(advice);
  EXPECT_GE(options.pixels, kMinPixels);
  require_room_for_design(16384, 16384, options, 1, "/");
}

TEST(DesignEstimate, NoPixelsAreAdvisedWhereNoneFit) {
  const auto refuse_without_memory = [] {
    rlimit limit{};
    ::getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = rlim_t{50} << 20U;
    ::setrlimit(RLIMIT_AS, &limit);
    try {
      require_room_for_design(256, 256, {}, 1, "/");
    } catch (const InputError& error) {
      ::_exit(std::string_view(error.what()).ends_with("; make room for it") ? 0 : 1);
    }
    ::_exit(2);
  };
  EXPECT_EXIT(refuse_without_memory(), ExitedWithCode(0), "");
}

}  // namespace
}  // namespace lensforge
