// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <map>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

/// What `design` does to a folder in which something lies already.
class DesignFolder : public Scenario {
 protected:
  [[nodiscard]] Arguments design(const Arguments& extra = {}) const {
    Arguments arguments = small_design(picture("rings.png"), path("lens"));
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    return arguments;
  }

  /// A design that takes longer than any test waits.
  [[nodiscard]] Arguments long_design(const Arguments& extra = {}) const {
    Arguments arguments = {"design",    picture("portrait.png"),
                           "--out",     path("lens"),
                           "--rounds",  "1000",
                           "--quality", "paper",
                           "--quiet"};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    return arguments;
  }

  /// Name and content of every file in the folder, those in its folders included.
  [[nodiscard]] std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(at("lens"))) {
      if (entry.is_regular_file()) found[entry.path().string()] = content(entry.path());
    }
    return found;
  }

  void interrupt_at_checkpoint(const Arguments& arguments) const {
    Process process(arguments);
    while (!fs::exists(at("lens/checkpoint.bin"))) {
      ASSERT_TRUE(process.runs_for(milliseconds(5))) << process.wait().err;
    }
    process.send(SIGINT);
    ASSERT_EQ(process.wait().exit_code, 130);
  }
};

TEST_F(DesignFolder, AUsersFileOfTheSameNameNeedsForce) {
  for (const char* name : {"target.png", "error.png", "surface.ply", "convergence.csv",
                           "overview.png", "render.exr"}) {
    fs::remove_all(at("lens"));
    fs::create_directory(at("lens"));
    write(at("lens") / name, "the user's own");
    expect_refusal(run(design()), 2, {name, "--force"});
    expect_refusal(run(design({"--resume"})), 2, {name, "--force"});
    EXPECT_EQ(content(at("lens") / name), "the user's own");
    EXPECT_EQ(listing(at("lens")), std::vector<std::string>{name});
  }
  EXPECT_EQ(run(design({"--force", "--quiet"})).exit_code, 0);
}

TEST_F(DesignFolder, WhatAKilledDesignHadPublishedIsItsOwn) {
  // Its files get their names one after the other, lens.json last.
  const auto spline = [&](const std::string& folder) {
    return Arguments{"design", picture("rings.png"), "--out", path(folder), "--pixels",
                     "32",     "--rounds",           "1",     "--quality",  "draft",
                     "--quiet"};
  };
  ASSERT_EQ(run(spline("whole")).exit_code, 0);
  ASSERT_TRUE(fs::exists(at("whole/surface.spline")));
  for (const std::string& name : listing(at("whole"))) {
    if (name == "lens.json") continue;
    fs::remove_all(at("lens"));
    fs::create_directory(at("lens"));
    fs::copy(at("whole") / name, at("lens") / name);
    const Outcome again = run(spline("lens"));
    EXPECT_EQ(again.exit_code, 0) << name << ": " << again.err;
  }
}

TEST_F(DesignFolder, AFolderInThePlaceOfAFileIsRefusedWhateverIsSaid) {
  fs::create_directories(at("lens/target.png/mine"));
  expect_refusal(run(design({"--force"})), 2, {"target.png", "no regular file"});
  EXPECT_TRUE(fs::exists(at("lens/target.png/mine")));
}

TEST_F(DesignFolder, AnInterruptedForcedDesignLeavesTheEarlierLens) {
  place_small_lens(at("lens"));
  const auto before = files();
  interrupt_at_checkpoint(long_design({"--force"}));
  fs::remove(at("lens/checkpoint.bin"));
  EXPECT_EQ(files(), before);
}

TEST_F(DesignFolder, AForcedDesignTakesTheCutOfTheEarlierLensAndNothingElse) {
  place_small_lens(at("lens"));
  fs::create_directory(at("lens/cam"));
  const Outcome cut =
      run({"cam", path("lens"), "--no-render", "--no-rough", "--no-semi", "--quiet"});
  ASSERT_TRUE(cut.exit_code == 0 || cut.exit_code == 3) << cut.err;
  ASSERT_TRUE(fs::exists(at("lens/cam/finish.ngc")));
  for (const char* name : {"notes.txt", "cam/finish-notes.txt", "cam/finish.bak"}) {
    write(at("lens") / name, "the user's own");
  }
  ASSERT_EQ(run(design({"--force"})).exit_code, 0);
  EXPECT_EQ(listing(at("lens/cam")), (std::vector<std::string>{"finish-notes.txt", "finish.bak"}));
  EXPECT_EQ(content(at("lens/notes.txt")), "the user's own");
}

TEST_F(DesignFolder, ARefusedRunLeavesTheFilesThatOthersAreWriting) {
  fs::create_directory(at("lens"));
  write(at("lens/.surface.partial-7.ply"), "another's");
  expect_refusal(run(design({"--focal", "1mm"})), 2, {"--focal"});
  EXPECT_EQ(listing(at("lens")), std::vector<std::string>{".surface.partial-7.ply"});
}

TEST_F(DesignFolder, HiddenFilesOfOthersStay) {
  fs::create_directory(at("lens"));
  write(at("lens/.thesis.partial-3.odt"), "the user's own");
  ASSERT_EQ(run(design()).exit_code, 0);
  EXPECT_EQ(content(at("lens/.thesis.partial-3.odt")), "the user's own");
}

TEST_F(DesignFolder, OnlyOneDesignAtATimeWorksInIt) {
  Process first(long_design());
  while (!fs::exists(at("lens/checkpoint.bin"))) ASSERT_TRUE(first.runs_for(milliseconds(5)));
  expect_refusal(run(design({"--force"})), 2, {"another lensforge command"});
  first.send(SIGKILL);
  first.wait();
  EXPECT_EQ(run(design({"--force", "--quiet"})).exit_code, 0);
}

TEST_F(DesignFolder, AFinishedLensOfOtherOptionsIsNotResumed) {
  place_small_lens(at("lens"));
  const auto before = files();
  expect_refusal(run(design({"--resume"})), 2, {"other options", "--force"});
  EXPECT_EQ(files(), before);
}

TEST_F(DesignFolder, AnInterruptedLensWithoutItsCheckpointIsNotResumed) {
  interrupt_at_checkpoint(long_design());
  fs::remove(at("lens/checkpoint.bin"));
  expect_refusal(run(long_design({"--resume"})), 2, {"checkpoint.bin is missing"});
}

TEST_F(DesignFolder, WhatDoesNotFitIntoMemoryIsRefusedWithWhatWould) {
  write(at("large.pgm"), "P5\n16384 16384\n255\n" + std::string(16384UL * 16384UL, '\x80'));
  expect_refusal(
      run({"design", path("large.pgm"), "--out", path("lens"), "--pixels", "16384", "--quiet"}), 2,
      {"--pixels 16384: needs about", "of memory", "would fit"});
}

}  // namespace
}  // namespace lensforge::scenario
