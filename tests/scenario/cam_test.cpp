// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <csignal>
#include <sstream>

#include "core/io/lens_folder.h"
#include "core/stop_bound.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// The finishing ball alone runs into the whole blank with its shank, and the report says so.
constexpr int kUnroughed = 3;

class Cam : public Scenario {
 protected:
  Cam() { place_small_lens(at("lens")); }

  /// A coarse finishing of the lens in the folder; the program only.
  [[nodiscard]] Arguments cam(const Arguments& more) const {
    Arguments arguments = {
        "cam",         path("lens"),        "--pitch",   "1.9mm",     "--tool-diameter",
        "2mm",         "--no-rough",        "--no-semi", "--surface", "facet",
        "--no-render", "--slope-tolerance", "5e-3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

TEST_F(Cam, ValuesThatNoWorkshopHasAreRefusedByTheirOption) {
  const std::pair<const char*, const char*> refused[] = {
      {"--safe-height", "1e9"},      {"--stock", "1e6"},  {"--rough-tool", "500mm"},
      {"--slope-tolerance", "1e-6"}, {"--pitch", "1e-9"}, {"--split", "0.01"},
      {"--max-leakage", "nan"}};
  for (const auto& [option, value] : refused) {
    expect_refusal(run({"cam", path("lens"), option, value}), 2, {option, value});
  }
  EXPECT_FALSE(fs::exists(at("lens/cam")));
}

TEST_F(Cam, WhatTheDiskDoesNotHoldIsRefusedWithAPitchThatWouldFit) {
  expect_refusal(run({"cam", path("lens"), "--pitch", "1e-6mm"}), 2,
                 {"--pitch 1e-06mm", "needs about", "mm would fit"});
  expect_refusal(run({"cam", path("lens"), "--compare", "pitch=0.1,1e-6"}), 2, {"mm would fit"});
  EXPECT_FALSE(fs::exists(at("lens/cam")));
}

TEST_F(Cam, TheWorkshopIsShownAsJson) {
  const Outcome outcome = run(cam({"--show-workshop", "--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["workshop"]["finish"]["pitch"], 1.9);
  EXPECT_EQ(outcome.json()["workshop"]["tool"].size(), 4U);
}

TEST_F(Cam, TheWorkshopIsShownWithoutAFolder) {
  const Outcome outcome = run({"cam", "--show-workshop", "--pitch", "0.05"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("\npitch = 0.05 "));
  expect_refusal(run({"cam", "--pitch", "0.05"}), 2, {"DIR: is missing", "lensforge cam portrait"});
}

TEST_F(Cam, AMistypedKeyIsNamedWithItsNumberAsWrittenAndTheKeyThatIsNear) {
  write(at("shop.toml"), "[finish]\npicth = 0.05\n");
  expect_refusal(run({"cam", "--show-workshop", "--workshop", path("shop.toml")}), 2,
                 {"finish.picth: 0.05: ", "unknown key; use pitch"});
}

TEST_F(Cam, ALimitThatNobodyStatedIsAdvice) {
  const Outcome advised = run(cam({}));
  EXPECT_THAT(advised.out, HasSubstr("  advice: error of the path's direction"));
  EXPECT_THAT(advised.out, Not(HasSubstr("limit missed: error of the path's direction")));
  const Outcome stated = run(cam({"--max-slope", "0.002"}));
  EXPECT_EQ(stated.exit_code, 3);
  EXPECT_THAT(stated.out, HasSubstr("  limit missed: error of the path's direction"));
}

TEST_F(Cam, AProgramThatWasEditedIsReplacedOnlyByForce) {
  ASSERT_EQ(run(cam({})).exit_code, kUnroughed);
  ASSERT_EQ(run(cam({})).exit_code, kUnroughed);
  const std::string edited = content(at("lens/cam/finish.ngc")) + "(mine)\n";
  write(at("lens/cam/finish.ngc"), edited);
  expect_refusal(run(cam({})), 2, {"finish.ngc", "--force"});
  EXPECT_EQ(content(at("lens/cam/finish.ngc")), edited);
  EXPECT_EQ(run(cam({"--force"})).exit_code, kUnroughed);
  EXPECT_NE(content(at("lens/cam/finish.ngc")), edited);
}

TEST_F(Cam, ProgramsOfAnEarlierJobGoWithTheNewOne) {
  ASSERT_EQ(run(cam({"--cross"})).exit_code, kUnroughed);
  ASSERT_THAT(listing(at("lens/cam")), Contains("cross.ngc"));
  write(at("lens/cam/old.ngc"), "M2\n");
  const Outcome outcome = run(cam({"--z-zero", "table"}));
  EXPECT_THAT(listing(at("lens/cam")), Not(Contains("cross.ngc")));
  EXPECT_THAT(outcome.err, HasSubstr("of another job, which were kept: old.ngc"));
}

/// Ways down of a program that are steeper than 1 : 1 at a feed above `plunge`.
int fast_dives(const std::string& program, double plunge) {
  std::istringstream lines(program);
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double feed = 0.0;
  bool rapid = true;
  int dives = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() == '(') continue;
    double to_x = x;
    double to_y = y;
    double to_z = z;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      const double value = std::stod(word.substr(1));
      if (word.front() == 'G' && value < 2.0) rapid = value == 0.0;
      if (word.front() == 'X') to_x = value;
      if (word.front() == 'Y') to_y = value;
      if (word.front() == 'Z') to_z = value;
      if (word.front() == 'F') feed = value;
    }
    const double run = std::hypot(to_x - x, to_y - y);
    if (!rapid && feed > plunge && z - to_z > run + 0.05) ++dives;
    x = to_x;
    y = to_y;
    z = to_z;
  }
  return dives;
}

/// A clamp over a corner of the blank, and a bar that is lower than the blank right across its rim.
TEST_F(Cam, BesideClampsToolsComeDownAtTheirPlungeFeed) {
  write(at("shop.toml"),
        "[[keep_out]]\nname = \"corner\"\nlow_x = -6.0\nlow_y = -6.0\nlow_z = 0.0\n"
        "high_x = 0.5\nhigh_y = 0.5\nhigh_z = 9.0\n"
        "[[keep_out]]\nname = \"bar\"\nlow_x = 5.0\nlow_y = -9.0\nlow_z = 0.0\n"
        "high_x = 7.0\nhigh_y = -1.0\nhigh_z = 4.8\n");
  Arguments design = small_design(picture("stripes.png"), path("small"));
  design.insert(design.end(), {"--width", "12mm"});
  ASSERT_EQ(run(design).exit_code, 0);
  const Outcome outcome =
      run({"cam", path("small"), "--workshop", path("shop.toml"), "--margin", "6", "--no-render",
           "--slope-tolerance", "1e-3", "--pitch", "0.2", "--json"});
  ASSERT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 3) << outcome.err;
  EXPECT_EQ(fast_dives(content(at("small/cam/rough.ngc")), 400.0), 0);
  EXPECT_EQ(fast_dives(content(at("small/cam/semi.ngc")), 300.0), 0);
  EXPECT_THAT(outcome.err, Not(HasSubstr("goes down into material")));
  const nlohmann::json checks = outcome.json()["report"]["verdict"]["checks"];
  EXPECT_TRUE(std::any_of(checks.begin(), checks.end(), [](const nlohmann::json& check) {
    return check["name"] == "descents" && check["pass"] == true;
  })) << checks;
}

TEST_F(Cam, ATravelTooShortAndAnotherIndexAreMissedLimits) {
  write(at("shop.toml"), "[machine]\ntravel_x = 90.0\n[material]\nior = 1.586\n");
  const Outcome outcome = run(cam({"--workshop", path("shop.toml")}));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.out, HasSubstr("limit missed: machine travel along X"));
  EXPECT_THAT(outcome.err, HasSubstr("the workshop's material has index 1.586, the lens was "
                                     "designed for 1.49"));
  EXPECT_THAT(content(at("lens/cam/report.html")), HasSubstr("machine&#39;s travel"));
}

TEST_F(Cam, AFolderThatAnotherCommandWritesIntoIsLeftAlone) {
  fs::create_directories(at("lens/cam"));
  const FolderLock lock(at("lens/cam"), FolderLock::Kind::kExclusive);
  write(at("lens/cam/.finish.partial-1.ngc"), "its");
  expect_refusal(run(cam({})), 2, {"lens"});
  EXPECT_EQ(content(at("lens/cam/.finish.partial-1.ngc")), "its");
}

TEST_F(Cam, FineTolerancesCanBeStopped) {
  Process process({"cam", path("lens"), "--slope-tolerance", "1e-5", "--tolerance", "4e-6",
                   "--no-rough", "--no-semi", "--no-render"});
  ASSERT_TRUE(process.runs_for(std::chrono::milliseconds(3000)));
  const auto asked = std::chrono::steady_clock::now();
  process.send(SIGINT);
  const Outcome outcome = process.wait();
  EXPECT_LT(std::chrono::steady_clock::now() - asked, lensforge::testing::kStopBound);
  EXPECT_EQ(outcome.exit_code, 130);
}

}  // namespace
}  // namespace lensforge::scenario
