// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

/// A coupon for Grbl in a folder of the test's own.
class Coupon : public Scenario {
 protected:
  [[nodiscard]] Outcome make(const Arguments& more = {}) const {
    Arguments arguments = {"coupon", "--out", path("coupon"), "--post", "grbl"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  [[nodiscard]] Outcome fit(const Arguments& more = {}) const {
    Arguments arguments = {"coupon", "--fit", path("coupon/measured.toml"), "--out",
                           path("fitted.toml")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  /// The tools of the default workshop, as a file has them.
  [[nodiscard]] static std::string tools() {
    std::string text;
    for (const char* tool :
         {"1\nshape = \"ball\"\ndiameter = 0.4", "2\nshape = \"ball\"\ndiameter = 1",
          "3\nshape = \"flat\"\ndiameter = 3"}) {
      text += std::string("\n[[tool]]\nnumber = ") + tool +
              "\nflute_length = 1\nfeed = 500\nplunge = 150\n";
    }
    return text;
  }
  /// Puts a reading into the file: after the nth line "# key =" of it.
  void take(const std::string& key, std::size_t entry, const std::string& value) const {
    std::string text = content(at("coupon/measured.toml"));
    const std::string line = "# " + key + " =";
    std::size_t place = text.find(line);
    for (std::size_t i = 0; i < entry; ++i) place = text.find(line, place + 1);
    ASSERT_NE(place, std::string::npos) << key;
    text.replace(place, line.size(), key + " = " + value);
    write(at("coupon/measured.toml"), text);
  }
  /// Readings of a workshop whose ball is 0.42 mm and whose σ is 26 µm.
  void take_readings() const {
    take("distance_mm", 0, "40.03");
    take("before_um", 3, "11.14");
    take("before_um", 2, "6.668");
    take("after_um", 2, "1.606");
    take("after_um", 2, "4.319");  // The next that is still a comment.
  }
};

TEST_F(Coupon, IsMadeSentMeasuredAndUsed) {
  const Outcome made = make({"--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(listing(at("coupon")),
            (std::vector<std::string>{"coupon.html", "coupon.ngc", "measured.toml"}));
  EXPECT_GT(made.json()["minutes"], 1.0);
  EXPECT_NEAR(made.json()["expected"]["polish.sigma"]["value"], 0.03, 1e-9);
  EXPECT_EQ(run({"send", path("coupon/coupon.ngc"), "--dry-run"}).exit_code, 0);
  EXPECT_THAT(run({"info", path("coupon/coupon.ngc")}).out, HasSubstr("seal          holds"));

  take_readings();
  write(at("mine.toml"), "[finish]\npitch = 0.08  # felt\n\n[stock]\nmargin = 1.0\n" + tools());
  const Outcome fitted = fit({"--workshop", path("mine.toml"), "--json"});
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const nlohmann::json values = fitted.json()["fit"];
  EXPECT_NEAR(values["polish.sigma"]["value"], 0.026, 2e-4);
  EXPECT_NEAR(values["tool.diameter"]["value"], 0.42, 2e-3);
  EXPECT_NEAR(values["finish.pitch_error"]["value"], 7.5e-4, 1e-9);
  EXPECT_THAT(content(at("fitted.toml")), HasSubstr("pitch = 0.08  # felt\n"));

  ASSERT_EQ(run({"design", picture("stripes.png"), "--out", path("lens"), "--pixels", "24",
                 "--width", "3mm", "--focal", "15mm", "--rounds", "1", "--quality", "draft"})
                .exit_code,
            0);
  const Outcome cut =
      run({"cam", path("lens"), "--light-model", "rays", "--no-rough", "--no-semi", "--no-remedies",
           "--workshop", path("fitted.toml"), "--json", "--force"});
  ASSERT_TRUE(cut.exit_code == 0 || cut.exit_code == 3) << cut.err;
  const nlohmann::json options = cut.json()["options"];
  EXPECT_EQ(options["polish-sigma"], values["polish.sigma"]["value"]);
  EXPECT_EQ(options["tool-diameter"], values["tool.diameter"]["value"]);
  EXPECT_EQ(options["pitch"], 0.08);
  EXPECT_EQ(options["margin"], 1.0);
  EXPECT_THAT(cut.out, HasSubstr("pitch error"));
}

TEST_F(Coupon, WhatIsNotMeasuredStaysAndIsNamed) {
  ASSERT_EQ(make().exit_code, 0);
  take("distance_mm", 0, "40.03");
  const Outcome fitted = fit();
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_THAT(fitted.out, HasSubstr("polish.sigma        0.03, not determined"));
  EXPECT_THAT(content(at("fitted.toml")), HasSubstr("pitch_error = 0.00075"));
}

TEST_F(Coupon, BadReadingsAreRefusedAndNothingIsWritten) {
  ASSERT_EQ(make().exit_code, 0);
  expect_refusal(fit(), 2, {"measured.toml: 0 readings"});
  take("width_mm", 0, "0.31");
  take("width_mm", 0, "nan");
  expect_refusal(fit(), 2, {"measured.toml: groove[1].width_mm: nan"});
  ASSERT_EQ(make({"--force"}).exit_code, 0);
  take("width_mm", 0, "3.34");
  expect_refusal(
      fit(), 2,
      {"groove[0].width_mm (G1): 3.34: must be in 0.1114 to 1.002", "the key names the unit"});
  ASSERT_EQ(make({"--force"}).exit_code, 0);
  for (const char* width : {"0.334", "0.211", "0.392", "0.286", "0.45"}) {
    take("width_mm", 0, width);
  }
  expect_refusal(fit(), 2, {"groove[4].width_mm (G5): 0.45", "standard deviations off"});
  EXPECT_FALSE(fs::exists(at("fitted.toml")));
  expect_refusal(make(), 2, {"measured.toml: holds readings", "--force"});
}

/// Light that a polish of 12 nm over 6 µm scatters at the angles that the template asks for.
TEST_F(Coupon, HazeGivesThePolishItsRoughness) {
  ASSERT_EQ(make().exit_code, 0);
  for (const char* ratio : {"2.556e-05", "1.002e-05", "3.333e-06", "6.527e-07"}) {
    take("light_ratio", 0, ratio);
    take("light_ratio_uncertainty", 0, "1e-07");
  }
  const Outcome fitted = fit({"--json"});
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const nlohmann::json values = fitted.json()["fit"];
  EXPECT_NEAR(values["polish.roughness"]["value"], 12.0, 0.05);
  EXPECT_NEAR(values["polish.correlation"]["value"], 6.0, 0.02);
  EXPECT_FALSE(values["polish.sigma"]["determined"]);
  EXPECT_THAT(content(at("fitted.toml")), HasSubstr("roughness = 1"));
  ASSERT_EQ(make({"--force"}).exit_code, 0);
  take("light_ratio", 0, "1.5");
  expect_refusal(fit(), 2, {"measured.toml: haze[0].light_ratio: 1.5: must be in 1e-12 to 1"});
}

TEST_F(Coupon, OptionsThatDoNotFitAreRefused) {
  expect_refusal(run({"coupon"}), 2, {"--out"});
  expect_refusal(run({"coupon", "--out", path("c"), "--length", "8mm"}), 2,
                 {"--length 8: must be at least"});
  expect_refusal(run({"coupon", "--out", path("c"), "--workshop", path("absent.toml")}), 2,
                 {"absent.toml"});
  expect_refusal(fit({"--length", "50mm"}), 2, {"--length", "--fit"});
  expect_refusal(fit(), 2, {"measured.toml", "No such file"});
  EXPECT_FALSE(fs::exists(at("c")));
}

}  // namespace
}  // namespace lensforge::scenario
