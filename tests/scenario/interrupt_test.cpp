// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <random>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using std::chrono::milliseconds;

constexpr const char* kCube =
    "OFF\n8 6 0\n0 0 0\n0 0 9\n0 9 0\n0 9 9\n9 0 0\n9 0 9\n9 9 0\n9 9 9\n"
    "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n4 0 2 6 4\n4 1 5 7 3\n";

class Interrupt : public Scenario {
 protected:
  void SetUp() override {
    place_small_lens(at("lens"));
    write(at("cube.off"), kCube);
    write(at("job.ngc"), "G21 G90\nS9000 M3\nG0 X1\nG1 Z-0.1 F9\nM5\nM2\n");
    write(at("jobs.jsonl"), R"({"name":"a","command":"design","target":")" +
                                picture("stripes.png") + R"(","options":{"quality":"draft"}})");
  }

  /// Every command with work for a second or more, but for info.
  [[nodiscard]] std::vector<Arguments> commands() const {
    return {small_design(picture("rings.png"), path("new")),
            {"plan", picture("portrait.png"), "--lamp", "laser"},
            {"render", path("lens"), "--pixels", "2000", "--out", path("new.png")},
            {"cam", path("lens"), "--light-model", "rays", "--pitch", "0.05mm"},
            {"nest", path("lens"), "--light-model", "rays", "--out", path("sheet"), "--blank",
             "400,400"},
            {"coupon", "--out", path("coupon")},
            {"export", path("lens"), "--out", path("new.step")},
            {"send", path("job.ngc"), "--port", "sim:grbl"},
            {"reflect", path("cube.off"), "--out", path("shape"), "--faces", "400"},
            {"view", path("lens"), "--out", path("new.html")},
            {"batch", path("jobs.jsonl"), "--out", path("jobs")},
            {"info", path("lens")}};
  }

  void expect_ends_as_it_should(const Arguments& arguments, int signal, milliseconds wait) const {
    SCOPED_TRACE(arguments.front() + ", signal " + std::to_string(signal) + " after " +
                 std::to_string(wait.count()) + " ms");
    for (const char* out : {"new", "sheet", "coupon", "shape", "jobs"}) fs::remove_all(at(out));
    Process process(arguments);
    const bool runs = process.runs_for(wait);
    const bool caught = process.catches(signal);
    process.send(signal);
    const Outcome outcome = process.wait();
    const bool done = outcome.exit_code == 0 || outcome.exit_code == 3;
    const bool died = outcome.signal == signal;
    EXPECT_TRUE(outcome.exit_code == 130 || done || died) << outcome.exit_code << outcome.err;
    // Only while its libraries are loaded the system ends it.
    EXPECT_FALSE(runs && caught && died);
    if (outcome.exit_code != 130) return;
    EXPECT_THAT(outcome.out + outcome.err, ::testing::HasSubstr("interrupted"));
  }
};

TEST_F(Interrupt, AtAnyMomentOfTheStartEndsEveryCommandWith130OrByTheSignal) {
  std::mt19937_64 random(2);
  for (const Arguments& arguments : commands()) {
    for (const int signal : {SIGINT, SIGTERM}) {
      expect_ends_as_it_should(arguments, signal, milliseconds(random() % 300));
    }
  }
}

TEST_F(Interrupt, AsSoonAsASignalIsCaughtItEndsTheCommandWith130) {
  int interrupted = 0;
  for (const Arguments& arguments : commands()) {
    Process process(arguments);
    while (!process.catches(SIGINT) && process.runs_for(milliseconds(1))) {
    }
    process.send(SIGINT);
    const Outcome outcome = process.wait();
    EXPECT_EQ(outcome.signal, 0) << arguments.front();
    interrupted += outcome.exit_code == 130 ? 1 : 0;
  }
  // Small ones may be done before.
  EXPECT_GE(interrupted, 7);
}

TEST_F(Interrupt, WithJsonItIsAnObjectToo) {
  Arguments arguments = small_design(picture("rings.png"), path("new"));
  arguments.emplace_back("--json");
  Process process(arguments);
  while (!process.catches(SIGTERM)) ASSERT_TRUE(process.runs_for(milliseconds(1)));
  ASSERT_TRUE(process.runs_for(milliseconds(3)));
  process.send(SIGTERM);
  const Outcome outcome = process.wait();
  ASSERT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_EQ(outcome.json().value("exit_code", 130), 130);
}

TEST_F(Interrupt, SignalsThatTheCallerIgnoresStayIgnored) {
  const std::string shell = std::string("trap '' INT; \"") + LENSFORGE_COMMAND + "\" info \"" +
                            path("lens") + "\" >/dev/null & sleep 0.3; kill -INT $!; wait $!";
  EXPECT_EQ(WEXITSTATUS(std::system(shell.c_str())), 0);
}

}  // namespace
}  // namespace lensforge::scenario
