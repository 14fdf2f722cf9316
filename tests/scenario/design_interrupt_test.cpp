// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <fstream>

#include "core/stop_bound.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using std::chrono::milliseconds;

/// A design of a few seconds with many checkpoints.
class DesignInterrupt : public Scenario {
 protected:
  Arguments design(const std::string& out, const Arguments& extra = {}) const {
    Arguments arguments = {
        "design", picture(picture_), "--out", path(out),  "--model", model_,      "--pixels",
        "48",     "--quality",       "draft", "--rounds", "4",       "--threads", "2"};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    return arguments;
  }

  /// Waits until the design in `out` has come as far as its first checkpoint.
  void wait_for_checkpoint(Process& process, const std::string& out) const {
    while (!fs::exists(at(out) / "checkpoint.bin")) {
      ASSERT_TRUE(process.runs_for(milliseconds(5))) << process.wait().err;
    }
  }

  /// A design without interruption, and the same killed after shares of its time and resumed.
  void kill_and_resume(const std::vector<double>& shares) const {
    const Outcome whole = run(design(model_ + "-whole"));
    ASSERT_EQ(whole.exit_code, 0) << whole.err;
    for (const double share : shares) {
      const std::string out = model_ + "-killed" + std::to_string(share);
      Process process(design(out));
      if (process.runs_for(milliseconds(static_cast<int>(1000.0 * share * whole.seconds)))) {
        process.send(SIGKILL);
      }
      process.wait();
      const Outcome resumed = run(design(out, {"--resume"}));
      ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
      expect_same_lens(model_ + "-whole", out);
      EXPECT_EQ(listing(at(model_ + "-whole")), listing(at(out)));
    }
  }

  void expect_one_and_two_threads_agree() const {
    Arguments one = design(model_ + "-one");
    one.back() = "1";
    ASSERT_EQ(run(one).exit_code, 0);
    ASSERT_EQ(run(design(model_ + "-two")).exit_code, 0);
    expect_same_lens(model_ + "-one", model_ + "-two");
  }

  void expect_same_lens(const std::string& a, const std::string& b) const {
    for (const char* file : {"surface.ply", "render.exr", "render.png", "target.exr"}) {
      ASSERT_TRUE(fs::exists(at(a) / file));
      EXPECT_TRUE(content(at(a) / file) == content(at(b) / file)) << file;
    }
  }

  std::string picture_ = "rings.png";
  std::string model_ = "facet";
};

/// Much of it black: its transport takes another way.
class DesignOnBlackInterrupt : public DesignInterrupt {
 protected:
  DesignOnBlackInterrupt() { picture_ = "logo.png"; }
};

TEST_F(DesignInterrupt, KilledAtAnyMomentAndResumedGivesTheSameLens) {
  kill_and_resume({0.1, 0.5, 0.9});
}

TEST_F(DesignOnBlackInterrupt, KilledAndResumedGivesTheSameLens) {
  for (const char* model : {"facet", "smooth"}) {
    model_ = model;
    kill_and_resume({0.4});
  }
}

TEST_F(DesignInterrupt, WhatAKilledRunWasWritingIsRemoved) {
  const fs::path half = at("a") / ".lens.partial-7";
  fs::create_directories(half);
  std::ofstream(half / "surface.ply") << "ply";
  std::ofstream(at("a") / ".surface.partial-7.ply") << "ply";
  std::ofstream(at("a") / "..surface.partial-7.partial-8.ply") << "ply";
  std::ofstream(at("a") / ".convergence.partial-7.csv") << "stage";
  ASSERT_EQ(run(design("a")).exit_code, 0);
  for (const std::string& name : listing(at("a"))) EXPECT_NE(name.front(), '.') << name;
}

TEST_F(DesignInterrupt, KilledAgainAndAgainStillArrives) {
  ASSERT_EQ(run(design("whole")).exit_code, 0);
  int kills = 0;
  for (int wait = 600;; wait += 300) {
    Process process(design("killed", {"--resume"}));
    if (!process.runs_for(milliseconds(wait))) {
      EXPECT_EQ(process.wait().exit_code, 0);
      break;
    }
    process.send(SIGKILL);
    process.wait();
    ++kills;
  }
  EXPECT_GE(kills, 1);
  expect_same_lens("whole", "killed");
}

TEST_F(DesignInterrupt, CtrlCKeepsWhatWasReachedAndIsResumable) {
  ASSERT_EQ(run(design("whole")).exit_code, 0);
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove_all(at("stopped"));
    Process process(design("stopped"));
    wait_for_checkpoint(process, "stopped");
    process.send(signal);
    const Outcome stopped = process.wait();
    EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
    EXPECT_EQ(run({"info", path("stopped")}).exit_code, 0);
    ASSERT_EQ(run(design("stopped", {"--resume"})).exit_code, 0);
    expect_same_lens("whole", "stopped");
  }
}

TEST_F(DesignInterrupt, CtrlCOnALargeDesignDoesNotWaitForItsIteration) {
  Process process({"design", picture("portrait.png"), "--out", path("lens"), "--mesh-ratio", "2.5",
                   "--rounds", "1", "--quality", "draft"});
  wait_for_checkpoint(process, "lens");
  ASSERT_TRUE(process.runs_for(std::chrono::seconds(3)));
  process.send(SIGINT);
  const auto sent = std::chrono::steady_clock::now();
  EXPECT_EQ(process.wait().exit_code, 130);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - sent;
  RecordProperty("seconds", std::to_string(taken.count()));
  EXPECT_LT(taken, lensforge::testing::kStopBound);
}

/// A grey progressive JPEG of 8192 x 8192 pixels whose many scans say nothing new: libjpeg goes
/// through all of them on opening, some thirty seconds of work (ITU-T T.81, Annex G).
std::string slow_jpeg() {
  using namespace std::string_literals;
  constexpr int kScans = 3000;
  constexpr std::size_t kBlocks = std::size_t{1024} * 1024;
  const std::string quantization = "\xFF\xDB\0\x43\0"s + std::string(64, '\x01');
  const std::string frame = "\xFF\xC2\0\x0B\x08\x20\0\x20\0\x01\x01\x11\0"s;
  const std::string one_code = "\x01"s + std::string(15, '\0');
  // The only codes are one 0 bit: a difference of nothing, and the end of 16384 blocks.
  const std::string tables =
      "\xFF\xC4\0\x14\0"s + one_code + "\0\xFF\xC4\0\x14\x10"s + one_code + "\xE0";
  const std::string flat = "\xFF\xDA\0\x08\x01\x01\0\0\0\0"s + std::string(kBlocks / 8, '\0');
  const std::string scan =
      "\xFF\xDA\0\x08\x01\x01\0\x01\x3F\0"s + std::string(kBlocks / 16384 * 15 / 8, '\0');
  std::string bytes = "\xFF\xD8"s + quantization + frame + tables + flat;
  for (int i = 0; i < kScans; ++i) bytes += scan;
  return bytes + "\xFF\xD9";
}

TEST_F(DesignInterrupt, CtrlCDoesNotWaitForADecoder) {
  write(at("slow.jpg"), slow_jpeg());
  Process process({"design", path("slow.jpg"), "--out", path("lens"), "--json"});
  ASSERT_TRUE(process.runs_for(std::chrono::seconds(2))) << process.wait().err;
  process.send(SIGINT);
  const auto sent = std::chrono::steady_clock::now();
  const Outcome stopped = process.wait();
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - sent;
  RecordProperty("seconds", std::to_string(taken.count()));
  EXPECT_EQ(stopped.exit_code, 130);
  EXPECT_THAT(stopped.err, ::testing::HasSubstr("interrupted; nothing was written"));
  EXPECT_LT(taken, lensforge::testing::kStopBound);
  EXPECT_FALSE(fs::exists(at("lens")));
}

TEST_F(DesignInterrupt, SecondCtrlCEndsAtOnce) {
  Process process(design("lens"));
  wait_for_checkpoint(process, "lens");
  process.send(SIGINT);
  process.send(SIGTERM);
  EXPECT_EQ(process.wait().exit_code, 130);
}

TEST_F(DesignInterrupt, AForcedDesignIsResumableToo) {
  ASSERT_EQ(run(design("whole")).exit_code, 0);
  place_small_lens(at("lens"));
  Process process(design("lens", {"--force"}));
  wait_for_checkpoint(process, "lens");
  process.send(SIGINT);
  ASSERT_EQ(process.wait().exit_code, 130);
  ASSERT_EQ(run(design("lens", {"--resume"})).exit_code, 0);
  expect_same_lens("whole", "lens");
}

TEST_F(DesignInterrupt, AFinishedDesignHasNothingToResume) {
  ASSERT_EQ(run(small_design(picture("rings.png"), path("lens"))).exit_code, 0);
  const auto written = fs::last_write_time(at("lens/lens.json"));
  Arguments again = small_design(picture("rings.png"), path("lens"));
  again.emplace_back("--resume");
  const Outcome outcome = run(again);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, ::testing::HasSubstr("finished"));
  EXPECT_EQ(fs::last_write_time(at("lens/lens.json")), written);
}

TEST_F(DesignInterrupt, ACheckpointOfOtherOptionsIsRefused) {
  Process process(design("lens"));
  wait_for_checkpoint(process, "lens");
  process.send(SIGINT);
  ASSERT_EQ(process.wait().exit_code, 130);
  const std::vector<std::string> before = listing(at("lens"));
  expect_refusal(run(design("lens", {"--resume", "--ior", "1.6"})), 2, {"checkpoint"});
  expect_refusal(run(design("lens")), 2, {"--resume", "--force"});
  EXPECT_EQ(listing(at("lens")), before);
}

TEST_F(DesignInterrupt, ACorruptCheckpointIsRefused) {
  fs::create_directory(at("lens"));
  write(at("lens/checkpoint.bin"), "no checkpoint");
  expect_refusal(run(design("lens", {"--resume"})), 2, {"checkpoint.bin"});
}

TEST_F(DesignInterrupt, OneAndTwoThreadsGiveTheSameBytes) { expect_one_and_two_threads_agree(); }

TEST_F(DesignOnBlackInterrupt, OneAndTwoThreadsGiveTheSameBytes) {
  expect_one_and_two_threads_agree();
  model_ = "smooth";
  expect_one_and_two_threads_agree();
}

}  // namespace
}  // namespace lensforge::scenario
