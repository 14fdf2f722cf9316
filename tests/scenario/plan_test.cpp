// SPDX-License-Identifier: GPL-3.0-or-later
#include <fstream>
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

TEST_F(Plan, APrintIsMadeAsItSays) {
  const Outcome outcome = run({"plan", picture("portrait.png"), "--part", "print", "--width", "30",
                               "--focal", "90", "--pixels", "32", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json plan = outcome.json()["proposals"][0];
  EXPECT_EQ(plan["light_model"], "rays");
  EXPECT_TRUE(plan["sheet_mm"].is_null());
  EXPECT_EQ(plan["blur"].back()["cause"], "steps");
  const json& print = plan["print"];
  const double layers = print["layers"];
  const double minutes = plan["minutes"];
  EXPECT_NEAR(minutes, 5.0 + layers * 8.0 / 60.0, 1e-9);
  EXPECT_EQ(plan["operations"][0]["name"], "print");
  EXPECT_EQ(plan["operations"][0]["minutes"], plan["minutes"]);
  const double height = print["box_mm"][2];
  EXPECT_NEAR(height, 5.0 + plan["relief_mm"].get<double>(), 1e-9);
  EXPECT_NEAR(layers, height / 0.025, 1.0);
  EXPECT_GT(print["steps_mae"].get<double>(), 0.0);
  EXPECT_THAT(plan["commands"][0].get<std::string>(),
              HasSubstr("--material resin --pixels 32 --width 30 --made-by default --part print"));

  Arguments design = words_of(plan["commands"][0]);
  design.back() = path("lens");
  design.emplace_back("--json");
  const Outcome designed = run(design);
  ASSERT_EQ(designed.exit_code, 0) << designed.err;
  EXPECT_THAT(designed.err, HasSubstr("lensforge export"));
  const double film = plan["mae"].get<double>() - print["steps_mae"].get<double>();
  EXPECT_NEAR(film, designed.json()["made"]["mae"].get<double>(), 0.3 * film);
  const json made = json::parse(content(at("lens/lens.json")))["provenance"]["made_by"];
  EXPECT_EQ(made["polish_sigma_mm"], 0.3);
  EXPECT_EQ(made["polish_order"], 4);
  Arguments exported = words_of(plan["commands"][1]);
  exported[1] = path("lens");
  exported.back() = path("lens.stl");
  EXPECT_EQ(run(exported).exit_code, 0);
}

TEST_F(Plan, APrintIsMadeOnTheWorkshopsPrinter) {
  std::ofstream(at("shop.toml")) << "[printer]\nlayer = 0.5\nfilm_sigma = 0.05\nupright = true\n"
                                    "seconds_per_layer = 60\nstart_minutes = 0\n";
  const Outcome outcome =
      run({"plan", picture("rings.png"), "--part", "print", "--made-by", path("shop.toml"),
           "--width", "20", "--focal", "60", "--pixels", "16", "--material", "pc", "--quiet"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const std::string& part :
       {std::string("does not show the picture: terraces"), std::string("pixels of "),
        std::string("40 layers of 0.5 mm"), std::string("40 min"), std::string("--material pc"),
        "--made-by " + path("shop.toml") + " --part print"}) {
    EXPECT_THAT(outcome.out, HasSubstr(part));
  }
  EXPECT_THAT(outcome.out, Not(HasSubstr("blank ")));
}

TEST_F(Plan, APrintThatCannotBeIsRefusedInOneLine) {
  const auto refuse = [&](const std::string& printer, const Arguments& more,
                          const std::vector<std::string>& parts) {
    std::ofstream(at("bad.toml")) << "[printer]\n" << printer << "\n";
    Arguments arguments{"plan",  picture("rings.png"), "--part",
                        "print", "--made-by",          path("bad.toml")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_refusal(run(arguments), 2, parts);
  };
  refuse("layer = 0", {}, {"bad.toml", "printer.layer", "0"});
  refuse("pixel = nan", {}, {"bad.toml", "printer.pixel"});
  refuse("film_order = 3", {}, {"printer.film_order", "3", "2 (pads and wheels) or 4"});
  refuse("colour = 1", {}, {"bad.toml", "colour"});
  refuse("bed_x = 50", {"--width", "60", "--pixels", "16"},
         {"--width 60", "60 x 60 x 5 mm", "50 x 80 x 160 mm", "--width 50 works"});
  refuse("bed_z = 3", {"--width", "60"}, {"60 x 60 x 5 mm", "no lens of this height does"});
  refuse("", {"--sheets", "5"}, {"--sheets 5", "--part lens"});
  expect_refusal(run({"plan", picture("rings.png"), "--part", "mould"}), 2, {"--part", "mould"});
  expect_refusal(run({"design", picture("rings.png"), "--part", "print", "--out", path("lens")}), 2,
                 {"--part", "needs --made-by"});
  expect_refusal(run({"cam", path("lens"), "--part", "print"}), 2, {"--part", "print"});
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
