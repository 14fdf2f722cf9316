// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>
#include <vector>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class Plan : public Scenario {};

/// The words of a command without its quotes, which these tests' paths do not need.
Arguments words_of(const std::string& command) {
  Arguments words;
  std::string word;
  for (const char c : command + " ") {
    if (c != ' ') {
      word += c;
    } else {
      words.push_back(word);
      word.clear();
    }
  }
  return {words.begin() + 1, words.end()};
}

TEST_F(Plan, WhatItProposesIsMadeAsItSays) {
  const Outcome outcome = run({"plan", picture("portrait.png"), "--lamp", "laser", "--width", "10",
                               "--focal", "60", "--pixels", "48", "--material", "pmma", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json plan = outcome.json()["proposals"][0];
  EXPECT_EQ(plan["title"], "as asked");

  Arguments design = words_of(plan["commands"][0]);
  design.back() = path("lens");
  design.insert(design.end(), {"--quiet"});
  ASSERT_EQ(run(design).exit_code, 0);
  const Outcome cut = run({"cam", path("lens"), "--no-remedies", "--json"});
  ASSERT_TRUE(cut.exit_code == 0 || cut.exit_code == 3) << cut.err;
  const json report = json::parse(content(at("lens/cam/report.json")));
  const double minutes = report["minutes"];
  EXPECT_NEAR(plan["minutes"].get<double>(), minutes, 0.2 * minutes);
  double made = 0.0;
  for (const json& surface : report["waves"]["surfaces"]) {
    if (surface["name"] == "polished") made = surface["mae"];
  }
  EXPECT_NEAR(plan["mae"].get<double>(), made, 0.3 * made);
  const double relief = report["setup"]["part"]["max"][2].get<double>() - 5.0;
  EXPECT_NEAR(plan["relief_mm"].get<double>(), relief, 0.1 * relief);
}

TEST_F(Plan, SaysWhatToExpectInWords) {
  const Outcome outcome = run({"plan", picture("rings.png"), "--lamp", "led:3mm@600mm", "--width",
                               "10", "--focal", "60", "--pixels", "24"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* part : {"As asked", "lens ", "light ", "expect ", "blank ", "machine ",
                           "lensforge design ", "--lamp led:3mm@600mm", "lensforge cam lens"}) {
    EXPECT_THAT(outcome.out, HasSubstr(part));
  }
}

TEST_F(Plan, ItsCommandKeepsWhatWasGivenBesideLampAndMaterial) {
  const Outcome outcome =
      run({"plan", picture("rings.png"), "--lamp", "led:3mm@600mm", "--source-size", "1.5",
           "--material", "pc", "--ior", "1.6", "--width", "10", "--focal", "60", "--pixels", "16"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("--lamp led:3mm@600mm"));
  EXPECT_THAT(outcome.out, HasSubstr("--material pc"));
  EXPECT_THAT(outcome.out, HasSubstr("--source-size 1.5"));
  EXPECT_THAT(outcome.out, HasSubstr("--ior 1.6"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("--emission")));
}

TEST_F(Plan, WhatCannotBeIsRefusedInOneLine) {
  expect_refusal(run({"plan"}), 2, {"PICTURE"});
  expect_refusal(run({"plan", path("none.png")}), 2, {"none.png"});
  expect_refusal(run({"plan", picture("rings.png"), "--lamp", "candle"}), 2, {"--lamp", "candle"});
  expect_refusal(run({"plan", picture("rings.png"), "--material", "wood"}), 2, {"wood"});
  expect_refusal(run({"plan", picture("rings.png"), "--sheets", "5,-1"}), 2, {"--sheets"});
  expect_refusal(run({"plan", picture("rings.png"), "--hours", "0"}), 2, {"--hours"});
}

TEST_F(Plan, RenderShowsALensUnderAnotherLamp) {
  ASSERT_EQ(run(small_design(picture("rings.png"), path("lens"))).exit_code, 0);
  const auto mae = [&](const Arguments& more) {
    Arguments arguments{"render", path("lens"), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.json()["metrics"].begin().value()["mae"].get<double>();
  };
  EXPECT_GT(mae({"--lamp", "sun"}), 2.0 * mae({}));
  EXPECT_NE(mae({"--material", "pc"}), mae({}));
}

}  // namespace
}  // namespace lensforge::scenario
