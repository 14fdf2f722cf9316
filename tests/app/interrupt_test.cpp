// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/interrupt.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>

namespace lensforge::app {
namespace {

/// In a process of its own, since the signal is remembered.
TEST(InterruptWatch, ASignalAtTheEndOfOneStopsTheNext) {
  const auto two_watches = [] {
    {
      const InterruptWatch first;
      std::raise(SIGTERM);
    }
    const InterruptWatch second;
    _exit(second.token().stop_requested() ? 0 : 1);
  };
  EXPECT_EXIT(two_watches(), ::testing::ExitedWithCode(0), "");
}

TEST(InterruptWatch, BeforeTheFirstASignalEndsTheProcessWith130) {
  const auto no_watch = [] {
    exit_at_signals();
    print_json_at_signals(true);
    std::raise(SIGINT);
  };
  EXPECT_EXIT(no_watch(), ::testing::ExitedWithCode(130), "^lensforge: interrupted\n$");
}

}  // namespace
}  // namespace lensforge::app
