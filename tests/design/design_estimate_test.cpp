// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <string>
#include <string_view>

#include "core/error.h"
#include "core/temp_folder.h"
#include "design/design.h"

namespace lensforge {
namespace {

using ::testing::ExitedWithCode;
using ::testing::HasSubstr;

std::string refusal_of(const DesignOptions& options) {
  return testing::message_of<InputError>(
      [&] { require_room_for_design(16384, 16384, options, 1, "/"); });
}

/// A design of a picture, and what it took: processor seconds, bytes.
struct Measured {
  const char* what;
  SurfaceModel model;
  int pixels;
  double seconds;
  double memory;
};

TEST(DesignEstimate, IsWithinThirtyPercentOfMeasuredDesigns) {
  // 2 GHz cores; docs/performance.md, "Design".
  for (const Measured& m : {Measured{"portrait", SurfaceModel::kSmooth, 128, 18, 2.8e8},
                            Measured{"logo", SurfaceModel::kSmooth, 128, 23, 2.8e8},
                            Measured{"portrait", SurfaceModel::kSmooth, 256, 70, 5.3e8},
                            Measured{"logo", SurfaceModel::kSmooth, 256, 80, 5.4e8},
                            Measured{"photograph", SurfaceModel::kSmooth, 512, 268, 1.08e9},
                            Measured{"portrait", SurfaceModel::kFacet, 128, 28, 2.8e8},
                            Measured{"portrait", SurfaceModel::kSpline, 64, 5.8, 2.7e8},
                            Measured{"logo", SurfaceModel::kSpline, 128, 24, 5.7e8},
                            Measured{"portrait", SurfaceModel::kSpline, 256, 102, 1.79e9}}) {
    DesignOptions options;
    options.model = m.model;
    options.pixels = m.pixels;
    const WorkEstimate estimate = estimate_design(512, 512, options, 1);
    EXPECT_NEAR(estimate.seconds / m.seconds, 1.0, 0.3) << m.what << m.pixels;
    EXPECT_NEAR(estimate.memory_bytes / m.memory, 1.0, 0.3) << m.what << m.pixels;
  }
}

TEST(DesignEstimate, TimeOfDesignsForAProcessIsWithinThirtyPercentToo) {
  DesignOptions options;
  options.model = SurfaceModel::kSpline;
  options.pixels = 128;
  options.width = 25.0;
  options.focal_length = 75.0;
  options.made_by = MadeBy{};
  EXPECT_NEAR(estimate_design(512, 512, options, 1).seconds / 327.0, 1.0, 0.3);
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
