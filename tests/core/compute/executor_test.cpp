// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/compute/executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <stop_token>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

std::vector<Executor> executors() {
  return {Executor::serial(), Executor::cpu(1), Executor::cpu(2), Executor::cpu(5)};
}

TEST(Executor, EveryItemIsVisitedOnce) {
  for (const Executor& executor : executors()) {
    for (const std::int64_t count : {0, 1, 1023, 100'000}) {
      std::vector<std::atomic<int>> visits(static_cast<std::size_t>(count));
      parallel_for(executor, "visit", count,
                   [&](std::int64_t i) { ++visits[static_cast<std::size_t>(i)]; });
      for (const auto& visit : visits) EXPECT_EQ(visit, 1);
    }
  }
}

TEST(Executor, TheSerialOneRunsInOrder) {
  std::vector<std::int64_t> order;
  parallel_for(Executor::serial(), "order", 5, [&](std::int64_t i) { order.push_back(i); });
  EXPECT_EQ(order, (std::vector<std::int64_t>{0, 1, 2, 3, 4}));
}

TEST(Executor, WorkerNumbersStayBelowConcurrency) {
  for (const Executor& executor : executors()) {
    std::atomic<int> largest = 0;
    const auto chunk = [](const void* body, std::int64_t, std::int64_t, int worker) {
      auto& seen = *static_cast<std::atomic<int>* const*>(body);
      int old = *seen;
      while (old < worker && !seen->compare_exchange_weak(old, worker)) {
      }
    };
    std::atomic<int>* const seen = &largest;
    executor.run("workers", 100'000, 10, chunk, &seen);
    EXPECT_LT(largest, executor.concurrency());
  }
}

TEST(Executor, SumsHaveTheSameBitsForAnyNumberOfThreads) {
  const auto item = [](std::int64_t i) {
    return std::array<double, 2>{std::sin(static_cast<double>(i)),
                                 1.0 / static_cast<double>(i + 1)};
  };
  const auto reference = parallel_sum<2>(Executor::serial(), "sum", 123'457, item);
  for (const Executor& executor : executors()) {
    EXPECT_EQ(parallel_sum<2>(executor, "sum", 123'457, item), reference);
  }
}

TEST(Executor, AnExceptionReachesTheCaller) {
  for (const Executor& executor : executors()) {
    EXPECT_THROW(parallel_for(executor, "throw", 10'000,
                              [](std::int64_t i) {
                                if (i == 7777) throw std::runtime_error("stop");
                              }),
                 std::runtime_error);
  }
}

TEST(Executor, AProfileCountsCallsPerKernel) {
  KernelProfile profile;
  const Executor executor = Executor::cpu(2).with_profile(&profile);
  for (int call = 0; call < 3; ++call) parallel_for(executor, "a", 10, [](std::int64_t) {});
  parallel_for(executor, "b", 10, [](std::int64_t) {});
  EXPECT_EQ(profile.entries().at("a").calls, 3);
  EXPECT_EQ(profile.entries().at("b").calls, 1);
  EXPECT_GE(profile.entries().at("a").seconds, 0.0);
  profile.clear();
  EXPECT_TRUE(profile.entries().empty());
}

TEST(Executor, AStopEndsARunningKernelAndRefusesTheNext) {
  for (const Executor& executor : {Executor::cpu(1), Executor::cpu(2)}) {
    std::stop_source source;
    const Executor stoppable = executor.with_stop(source.get_token());
    std::atomic<int> calls = 0;
    const auto stop_early = [&](std::int64_t) {
      ++calls;
      source.request_stop();
    };
    EXPECT_THROW(parallel_for(stoppable, "stopped", 1'000'000, stop_early), Interrupted);
    EXPECT_LT(calls, 1'000'000);
    EXPECT_THROW(parallel_for(stoppable, "next", 1, stop_early), Interrupted);
    EXPECT_NO_THROW(parallel_for(executor, "without", 1, stop_early));
  }
}

TEST(RunControl, TheDefaultNeitherReportsNorStops) {
  const RunControl control;
  control.report({"stage", 1.0, 2.0, ""});
  EXPECT_FALSE(control.stop_requested());
}

TEST(RunControl, ReportsReachTheSinkAndStopsTheWork) {
  std::stop_source source;
  double done = 0.0;
  const RunControl control(source.get_token(), [&](const Progress& p) { done = p.done; });
  control.report({"stage", 3.0, 4.0, ""});
  EXPECT_EQ(done, 3.0);
  EXPECT_FALSE(control.stop_requested());
  source.request_stop();
  EXPECT_TRUE(control.stop_requested());
}

}  // namespace

}  // namespace lensforge
