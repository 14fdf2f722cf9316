// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/sandbox/child_work.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/stop_bound.h"
#include "core/temp_folder.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;
using Work = std::function<std::string(const RunControl&)>;

std::string run(const Work& work, const ChildLimits& limits = {}) {
  return run_in_child("work", limits, work, {});
}

std::string failure_of(const Work& work, const ChildLimits& limits = {}) {
  return message_of<ChildFailure>([&] { run(work, limits); });
}

TEST(ChildWork, ResultIsWhatTheWorkReturns) {
  EXPECT_EQ(run([](const RunControl&) { return "seven"; }), "seven");
  EXPECT_EQ(run([](const RunControl&) { return ""; }), "");
  std::string large;
  large.resize(20'000'000, 'a');
  large.back() = 'z';
  EXPECT_TRUE(run([&](const RunControl&) { return large; }) == large);
}

TEST(ChildWork, ErrorsKeepTheirKindAndMessage) {
  EXPECT_EQ(message_of<InputError>(
                [] { run([](const RunControl&) -> std::string { throw InputError("no lens"); }); }),
            "no lens");
  EXPECT_EQ(message_of<RunError>(
                [] { run([](const RunControl&) -> std::string { throw RunError("disk full"); }); }),
            "disk full");
  EXPECT_THAT(failure_of([](const RunControl&) -> std::string { throw std::range_error("far"); }),
              HasSubstr("far"));
  EXPECT_EQ(failure_of([](const RunControl&) -> std::string { throw 7; }), "failed");
}

TEST(ChildWork, CrashesAreFailures) {
  for (const int signal : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS}) {
    EXPECT_EQ(failure_of([&](const RunControl&) -> std::string {
                std::raise(signal);
                return "";
              }),
              "crashed");
  }
  EXPECT_THAT(failure_of([](const RunControl&) -> std::string { _exit(0); }),
              HasSubstr("without a result"));
}

TEST(ChildWork, MemoryIsLimited) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "with the address sanitizer, which maps terabytes, children have no limit";
#endif
  const auto hoard = [](const RunControl&) {
    std::vector<std::string> kept;
    while (kept.size() < 2000) kept.emplace_back(std::size_t{1} << 20, 'x');
    return std::string();
  };
  EXPECT_THAT(failure_of(hoard, {.memory_bytes = 2e8}), HasSubstr("memory"));
}

TEST(ChildWork, TimeIsLimited) {
  const auto spin = [](const RunControl&) {
    for (volatile int i = 0; i >= 0;) i = (i + 1) % 1000;
    return std::string();
  };
  EXPECT_THAT(failure_of(spin, {.cpu_seconds = 1.0}), HasSubstr("no end"));
}

TEST(ChildWork, StopRequestEndsIt) {
  std::stop_source stop;
  std::string stage;
  const RunControl control(stop.get_token(), [&](const Progress& progress) {
    stage = progress.stage;
    stop.request_stop();
  });
  const auto start = std::chrono::steady_clock::now();
  const auto wait = [](const RunControl& inner) {
    inner.report({"", 1.0, 2.0, ""});
    std::this_thread::sleep_for(std::chrono::seconds(60));
    return std::string();
  };
  EXPECT_THROW(run_in_child("reading", {}, wait, control), Interrupted);
  EXPECT_LT(std::chrono::steady_clock::now() - start, lensforge::testing::kStopBound);
  EXPECT_EQ(stage, "reading");
}

TEST(ChildWork, ProgressOfTheWorkReachesTheCaller) {
  double most = 0.0;
  const RunControl control({}, [&](const Progress& p) {
    if (p.total > 0.0) most = std::max(most, p.done / p.total);
  });
  const auto work = [](const RunControl& inner) {
    for (int i = 1; i <= 4; ++i) {
      inner.report({"", double{1} * i, 4.0, ""});
      std::this_thread::sleep_for(std::chrono::milliseconds(60));
    }
    return std::string();
  };
  run_in_child("work", {}, work, control);
  EXPECT_GE(most, 0.5);
}

TEST(ChildWork, EveryNewDetailOfTheWorkReachesTheCaller) {
  std::vector<std::string> details;
  const RunControl control({}, [&](const Progress& p) {
    if (details.empty() || details.back() != p.detail) details.push_back(p.detail);
  });
  const auto work = [](const RunControl& inner) {
    inner.report({"", 0.0, 0.0, "converting"});
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    inner.report({"", 1.0, 1.0, "converting"});
    inner.report({"", 0.0, 0.0, "checking"});
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return std::string();
  };
  run_in_child("work", {}, work, control);
  if (!details.empty() && details.front().empty()) details.erase(details.begin());
  EXPECT_THAT(details, ::testing::ElementsAre("converting", "checking"));
}

TEST(ChildWork, OwnThreadsDoEveryItemOnceAndPassErrorsOn) {
  std::vector<int> done(1000, 0);
  for_each_in_threads(4, 1000, [&](std::int64_t i) { ++done[static_cast<std::size_t>(i)]; });
  EXPECT_EQ(done, std::vector<int>(1000, 1));
  EXPECT_THROW(for_each_in_threads(3, 50, [](std::int64_t) { throw RunError("no"); }), RunError);
}

TEST(ByteRecord, ReadsBackWhatWasWritten) {
  Eigen::Matrix3Xd matrix = Eigen::Matrix3Xd::Random(3, 5);
  ByteWriter writer;
  writer.put(true);
  writer.put(matrix);
  writer.put(Eigen::Matrix3Xi(3, 0));
  writer.put(2.5);
  const std::string bytes = writer.take();
  ByteReader reader(bytes);
  EXPECT_TRUE(reader.get<bool>());
  EXPECT_EQ(reader.matrix<double>(), matrix);
  EXPECT_EQ(reader.matrix<int>().cols(), 0);
  EXPECT_EQ(reader.get<double>(), 2.5);
}

}  // namespace
}  // namespace lensforge::testing
