// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/image/image_io.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

/// A colour picture: hues around its middle, paler towards it.
void draw_hues(const std::filesystem::path& path) {
  ColorImage image{24, 24, {}};
  for (int row = 0; row < 24; ++row) {
    for (int column = 0; column < 24; ++column) {
      const double x = (column - 11.5) / 12.0;
      const double y = (row - 11.5) / 12.0;
      for (const double hue : {0.0, 2.1, 4.2}) {
        const double part = 0.5 + 0.35 * std::hypot(x, y) * std::cos(std::atan2(y, x) - hue);
        image.rgb.push_back(static_cast<unsigned char>(std::lround(255.0 * part)));
      }
    }
  }
  write_image(image, path);
}

class ThreeLamps : public Scenario {
 protected:
  [[nodiscard]] Arguments hues(const Arguments& more = {}) const {
    draw_hues(path("hues.png"));
    Arguments arguments{"design",  path("hues.png"), "--color", "three-lamps", "--pixels",
                        "24",      "--width",        "12mm",    "--focal",     "80mm",
                        "--quiet", "--quality",      "draft"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

TEST_F(ThreeLamps, AddUpToAPictureInColour) {
  const Outcome made = run(hues({"--out", path("hues"), "--lamp-gap", "9mm", "--json"}));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json result = made.json();
  EXPECT_LT(result["delta_e"]["mean"].get<double>(), 1.0);
  EXPECT_LT(result["delta_e"]["max"].get<double>(), 6.0);
  EXPECT_EQ(result["outside"], 0.0);
  for (const auto& [fault, good] :
       {std::pair("wall_1_percent", "wall_percent"), std::pair("lamp_1_mrad", "lamp_mrad")}) {
    const double difference = result["registration_delta_e"][fault];
    EXPECT_GT(difference, result["delta_e"]["mean"].get<double>()) << fault;
    const double up_to = result["registration_good"][good];
    EXPECT_GT(up_to, 0.0) << good;
    EXPECT_EQ(difference <= 2.0, up_to >= 1.0) << good;
  }
  double watts = 0.0;
  std::vector<std::string> folders;
  for (const nlohmann::json& lamp : result["lamps"]) {
    watts += lamp["share_of_watts"].get<double>();
    folders.push_back(lamp["lens"]);
    const nlohmann::json lens =
        nlohmann::json::parse(content(at("hues/" + folders.back() + "/lens.json")));
    // The three pictures are at one place of the wall.
    EXPECT_NEAR(lens["image_origin"][0].get<double>() + lamp["x_mm"].get<double>(), 0.0, 1e-9);
    EXPECT_EQ(lens["spectrum"]["wavelengths_nm"], nlohmann::json({lamp["wavelength_nm"]}));
  }
  EXPECT_NEAR(watts, 1.0, 1e-12);
  EXPECT_EQ(folders, (std::vector<std::string>{"red", "green", "blue"}));

  // An independent trace of each lens finds its picture where and as it is said to be.
  for (const std::string& name : folders) {
    const nlohmann::json traced =
        json_printed_by(std::string(LENSFORGE_TRACER) + " '" + path("hues/" + name) + "' spline");
    const nlohmann::json lens = nlohmann::json::parse(content(at("hues/" + name + "/lens.json")));
    EXPECT_NEAR(traced["mae"].get<double>(), lens["metrics"]["spline"]["mae"].get<double>(), 1e-3)
        << name;
  }
  EXPECT_GT(read_image(at("hues/color.png")).image.total(), 0.0);
  EXPECT_EQ(nlohmann::json::parse(content(at("hues/color.json")))["color"]["delta_e"],
            result["delta_e"]);

  // One blank takes all three.
  const Outcome nest = run({"nest", path("hues/red"), path("hues/green"), path("hues/blue"),
                            "--blank", "74,32", "--gap", "9mm", "--pitch", "0.3mm", "--no-semi",
                            "--light-model", "rays", "--out", path("cut"), "--quiet", "--json"});
  ASSERT_LE(nest.exit_code, 3) << nest.err;
  const nlohmann::json places = nlohmann::json::parse(content(at("cut/nest.json")))["lenses"];
  for (std::size_t k = 1; k < 3; ++k) {
    EXPECT_NEAR(places[k]["at"][0].get<double>() - places[k - 1]["at"][0].get<double>(), 21.0,
                1e-9);
  }

  expect_refusal(run(hues({"--out", path("hues")})), 2, {"--out", "holds a lens already"});
  const Outcome again = run(hues({"--out", path("hues"), "--lamp-gap", "9mm", "--resume"}));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("in colour  mean difference"));
}

TEST_F(ThreeLamps, NearbyStandAslantSoThatNoLensIsAWedge) {
  const Outcome made = run(
      hues({"--out", path("near"), "--source", "point", "--source-distance", "200mm", "--json"}));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json result = made.json();
  EXPECT_LT(result["delta_e"]["mean"].get<double>(), 1.0);
  for (const nlohmann::json& lamp : result["lamps"]) {
    const std::string folder = "near/" + lamp["lens"].get<std::string>();
    const nlohmann::json lens = nlohmann::json::parse(content(at(folder + "/lens.json")));
    const double x = lamp["x_mm"].get<double>();
    // Up to how colours shift in the plate below the surface.
    EXPECT_NEAR(lens["image_origin"][0].get<double>() + x, 0.0, 0.005);
    // The lamp is on the line through the lens's middle and the picture's.
    EXPECT_NEAR(lens["source"]["position"][0].get<double>(), 6.0 + x * 200.0 / 80.0, 1e-9);
    const nlohmann::json about = run({"info", at(folder), "--json"}).json();
    // A wedge would rise by 6.5 mm.
    EXPECT_LT(about["z"][1].get<double>() - about["z"][0].get<double>(), 2.0) << about;
  }
}

TEST_F(ThreeLamps, WhatTheyCannotHaveIsRefusedInOneLine) {
  const std::pair<Arguments, std::vector<std::string>> faults[] = {
      {{"--lamps", "625,525"}, {"--lamps 625,525", "3 finite numbers"}},
      {{"--lamps", "465,525,625"}, {"--lamps 465,525,625", "625,525,465 works"}},
      {{"--lamps", "700,650,600"}, {"--lamps 700,650,600", "together can be white"}},
      {{"--wavelengths", "450,550"}, {"--wavelengths", "--color three-lamps"}},
      {{"--lamp", "sun"}, {"--lamp", "--color three-lamps"}},
      {{"--live", "0"}, {"--live", "--color three-lamps"}},
      {{"--lamp-gap", "-1mm"}, {"--lamp-gap -1mm", "must be 0 to"}},
  };
  for (const auto& [options, words] : faults) {
    Arguments arguments = hues({"--out", path("no")});
    arguments.insert(arguments.end(), options.begin(), options.end());
    expect_refusal(run(arguments), 2, words);
    EXPECT_FALSE(std::filesystem::exists(path("no"))) << options[0];
  }
  // A red deeper than the red lamp's has no green in it.
  ColorImage red{8, 8, {}};
  for (int i = 0; i < 64; ++i) red.rgb.insert(red.rgb.end(), {255, 0, 0});
  write_image(red, path("red.png"));
  expect_refusal(run({"design", path("red.png"), "--color", "three-lamps", "--lamps", "600,525,465",
                      "--out", path("no")}),
                 2, {"red.png", "nothing for the green lamp"});
}

}  // namespace
}  // namespace lensforge::scenario
