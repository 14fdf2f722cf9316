// SPDX-License-Identifier: GPL-3.0-or-later
#include <fstream>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A lens of 3 mm that is cut with passes of 0.045 mm.
class MadeBy : public Scenario {
 protected:
  MadeBy() { std::ofstream(at("shop.toml")) << "[finish]\npitch = 0.045\n"; }

  [[nodiscard]] Outcome design(const Arguments& more) const {
    Arguments arguments = {"design",    picture("portrait.png"),
                           "--out",     path("lens"),
                           "--pixels",  "24",
                           "--width",   "3mm",
                           "--focal",   "15mm",
                           "--rounds",  "4",
                           "--quality", "draft",
                           "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  Outcome cut(const Arguments& more) const {
    Arguments arguments = {"cam",           path("lens"), "--light-model", "rays",
                           "--no-rough",    "--no-semi",  "--workshop",    path("shop.toml"),
                           "--no-remedies", "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  [[nodiscard]] double part_mae() const {
    const nlohmann::json report = json_at("lens/cam/report.json");
    for (const nlohmann::json& surface : report["surfaces"]) {
      if (surface["name"] == "polished") return surface["mae"];
    }
    return 1.0;
  }
  [[nodiscard]] std::string warnings() const {
    return json_at("lens/cam/report.json")["warnings"].dump();
  }
  [[nodiscard]] nlohmann::json json_at(const std::string& name) const {
    return nlohmann::json::parse(content(at(name)));
  }
};

TEST_F(MadeBy, APartIsBetterIfItsDesignKnowsHowItIsMade) {
  ASSERT_EQ(design({"--model", "spline"}).exit_code, 0);
  cut({});
  const double unaware = part_mae();
  const Outcome outcome = design({"--made-by", path("shop.toml"), "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const double promised = outcome.json()["made"]["mae"];
  EXPECT_EQ(json_at("lens/lens.json")["provenance"]["made_by"]["pitch_mm"], 0.045);
  EXPECT_EQ(json_at("lens/lens.json")["provenance"]["made_by"]["metrics"]["mae"], promised);
  cut({});
  EXPECT_THAT(warnings(), Not(HasSubstr("was designed for")));
  // What cam finds in its own programs; the design's own account leaves out what is left of the
  // scallops and what the ball fills.
  EXPECT_LT(part_mae(), 0.7 * unaware);
  EXPECT_GT(part_mae(), 0.95 * promised);
  EXPECT_LT(part_mae(), 1.4 * promised);
  cut({"--pitch", "0.06mm", "--no-render"});
  EXPECT_THAT(warnings(), HasSubstr("was designed for a pitch of 0.045 mm"));
}

TEST_F(MadeBy, ACastPartIsDesignedForItsMould) {
  const Arguments mould = {"--part", "mould", "--shrinkage", "0.2"};
  ASSERT_EQ(
      design({"--made-by", path("shop.toml"), "--part", "mould", "--shrinkage", "0.2"}).exit_code,
      0);
  const nlohmann::json made = json_at("lens/lens.json")["provenance"]["made_by"];
  EXPECT_NEAR(made["pitch_mm"], 0.036, 1e-12);
  cut(mould);
  EXPECT_THAT(warnings(), Not(HasSubstr("was designed for")));
  const double promised = made["metrics"]["mae"];
  EXPECT_GT(part_mae(), 0.95 * promised);
  EXPECT_LT(part_mae(), 1.2 * promised);
  cut({"--no-render"});
  EXPECT_THAT(warnings(), HasSubstr("was designed for a pitch of 0.036 mm"));
}

/// The design is the same; its picture of the part has the haze that cam's has.
TEST_F(MadeBy, APartsRoughnessHazesItsPicture) {
  ASSERT_EQ(design({"--made-by", path("shop.toml")}).exit_code, 0);
  const std::string surface = content(at("lens/surface.spline"));
  const double clear = json_at("lens/lens.json")["provenance"]["made_by"]["metrics"]["mae"];
  cut({});
  const double clear_part = part_mae();
  const std::string overview = content(at("lens/overview.png"));
  std::ofstream(at("shop.toml"), std::ios::app) << "[polish]\nroughness = 40\n";
  ASSERT_EQ(design({"--made-by", path("shop.toml")}).exit_code, 0);
  const nlohmann::json made = json_at("lens/lens.json")["provenance"]["made_by"];
  EXPECT_EQ(made["roughness_nm"], 40.0);
  EXPECT_EQ(made["correlation_um"], 5.0);
  EXPECT_EQ(content(at("lens/surface.spline")), surface);
  EXPECT_NE(content(at("lens/overview.png")), overview);
  const double hazed = made["metrics"]["mae"];
  cut({});
  EXPECT_GT(hazed, clear + 0.002);
  EXPECT_NEAR(part_mae() - clear_part, hazed - clear, 0.2 * (hazed - clear));
  const nlohmann::json haze = json_at("lens/cam/report.json")["light"]["haze"];
  EXPECT_NEAR(haze["share"], 0.049, 0.001);
}

/// The programs, cut by brute force into a blank that goes on beyond the lens, polished and traced
/// by code of its own, rim included.
TEST_F(MadeBy, APartByBruteForceHasTheForecastsPictureUpToItsRim) {
  for (const Arguments& how : {Arguments{"--model", "facet"}, Arguments{"--model", "smooth"},
                               Arguments{"--made-by", path("shop.toml")}}) {
    SCOPED_TRACE(how.back());
    ASSERT_EQ(design(how).exit_code, 0);
    cut({"--z-zero", "table"});
    const nlohmann::json report = json_at("lens/cam/report.json");
    const double top = report["setup"]["blank"]["max"][2];
    const std::string command = std::string(LENSFORGE_PART_TRACER) + " '" + path("lens") +
                                "' 0.2 0.03 " + std::to_string(top) + " '" +
                                path("lens/cam/finish.ngc") + "'";
    const double traced = json_printed_by(command)["mae"];
    EXPECT_NEAR(part_mae(), traced, std::max(2e-4, 0.1 * traced));
  }
}

TEST_F(MadeBy, ABlankThatEndsTooNearToTheLensIsRefused) {
  place_small_lens(at("lens"));
  expect_refusal(cut({"--margin", "0.3mm"}), 2, {"stock.margin 0.3", "0.44 mm works"});
  EXPECT_NE(cut({"--margin", "0.44mm", "--no-render"}).exit_code, 2);
}

TEST_F(MadeBy, WhatCannotBeDesignedForIsRefused) {
  expect_refusal(design({"--made-by", "default", "--model", "facet"}), 2,
                 {"--made-by default", "--model spline", "facet"});
  expect_refusal(design({"--made-by", path("absent.toml")}), 2, {"absent.toml"});
  std::ofstream(at("raw.toml")) << "[polish]\nsigma = 0\n";
  expect_refusal(design({"--made-by", path("raw.toml")}), 2, {"polish.sigma 0", "not polished"});
  std::ofstream(at("fine.toml")) << "[polish]\nsigma = 0.0001\n";
  expect_refusal(design({"--made-by", path("fine.toml")}), 2,
                 {"polish.sigma 0.0001", "too fine", "at least 0.0004 mm"});
  expect_refusal(design({"--part", "mould"}), 2, {"--part", "needs --made-by"});
  expect_refusal(design({"--made-by", "default", "--shrinkage", "0.3"}), 2, {"--shrinkage 0.3"});
  expect_refusal(design({"--made-by", "default", "--shrinkage", "0.1"}), 2,
                 {"--shrinkage 0.1", "--part mould"});
  EXPECT_FALSE(fs::exists(at("lens")));
}

}  // namespace
}  // namespace lensforge::scenario
