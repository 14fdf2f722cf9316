// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/work_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(WorkEstimate, IsToldInUnitsThatAPersonReads) {
  EXPECT_EQ(estimate_words({725.0, 3.4e8, 1.234e9}),
            "about 12 min, 340 MB on disk, 1.2 GB of memory");
  EXPECT_EQ(estimate_words({4.4e5, 5e12, 900.0}), "about 5.1 days, 5 TB on disk, 0.9 kB of memory");
}

TEST(WorkEstimate, WhatFitsIsLetThrough) {
  const TempFolder folder;
  require_room({1e9, 1e3, 1e3}, folder / "not/there/yet", "--pitch 1mm", "");
}

TEST(WorkEstimate, WhatDoesNotFitIsRefusedWithTheValueThatWould) {
  const TempFolder folder;
  const auto refusal = [&](double disk, double memory) {
    return message_of<InputError>([&] {
      require_room({1.0, disk, memory}, folder.path(), "--pitch 1e-09mm", "0.01mm would fit");
    });
  };
  EXPECT_THAT(refusal(1e18, 0.0), AllOf(HasSubstr("--pitch 1e-09mm: needs about 1000 PB on disk"),
                                        HasSubstr("0.01mm would fit")));
  EXPECT_THAT(refusal(0.0, 1e18), HasSubstr("of memory"));
  EXPECT_THAT(refusal(0.0, std::numeric_limits<double>::quiet_NaN()), HasSubstr("of memory"));
}

TEST(WorkEstimate, LargestWithRoomHasRoom) {
  const auto work = [](double count) { return WorkEstimate{.memory_bytes = 1e6 * count}; };
  const std::int64_t fits = largest_with_room(work, 1e12, "/");
  EXPECT_GT(fits, 0);
  EXPECT_LE(1e6 * static_cast<double>(fits), 0.8 * free_memory_bytes());
  EXPECT_EQ(largest_with_room(work, 1e-9, "/"), 0);
}

TEST(WorkEstimate, OnlyAValueThatTheOptionTakesIsAdvised) {
  const auto refusal = [](double memory_for_one, int least) {
    const auto work = [&](double count) {
      return WorkEstimate{.memory_bytes = memory_for_one * count};
    };
    return message_of<InputError>(
        [&] { require_room_for(work, {.name = "--pixels", .value = 1e12, .least = least}, "/"); });
  };
  EXPECT_THAT(refusal(1e6, 4),
              AllOf(HasSubstr("--pixels 1e+12: needs about"), HasSubstr(" would fit")));
  EXPECT_THAT(refusal(0.3 * free_memory_bytes(), 2), HasSubstr("; --pixels 2 would fit"));
  EXPECT_THAT(refusal(0.3 * free_memory_bytes(), 4), HasSubstr("; make room for it"));
  EXPECT_THAT(refusal(1e18, 1), HasSubstr("; make room for it"));
}

}  // namespace
}  // namespace lensforge
