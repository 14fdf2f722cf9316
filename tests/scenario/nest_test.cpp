// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

/// Two lens folders that are cut out of one blank, the finishing coarse and the programs only.
class Nest : public Scenario {
 protected:
  Nest() {
    place_small_lens(at("bee"));
    place_small_lens(at("disc"));
  }

  [[nodiscard]] Outcome nest(const Arguments& more) const {
    Arguments arguments = {
        "nest",        path("bee"),       path("disc"),  path("bee"),         "--out",
        path("sheet"), "--tool-diameter", "2mm",         "--pitch",           "1.9mm",
        "--surface",   "facet",           "--no-render", "--slope-tolerance", "5e-3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
};

TEST_F(Nest, LensesOfOneBlankGetOneProgramForEachOperation) {
  const Outcome made = nest({"--blank", "400,200", "--json"});
  ASSERT_TRUE(made.exit_code == 0 || made.exit_code == 3) << made.err;
  const nlohmann::json json = made.json();
  EXPECT_EQ(json["command"], "nest");
  EXPECT_EQ(json["lenses"].size(), 3U);
  EXPECT_EQ(json["lenses"][2]["name"], "bee_2");
  EXPECT_EQ(json["lenses"][2]["folder"], path("bee"));
  EXPECT_EQ(json["programs"].size(), 4U);
  EXPECT_EQ(listing(at("sheet")),
            (std::vector<std::string>{"bee", "bee_2", "disc", "finish.ngc", "layout.svg",
                                      "nest.json", "outline.ngc", "rough.ngc", "semi.ngc"}));
  EXPECT_EQ(listing(at("sheet/bee")), (std::vector<std::string>{"report.html", "report.json"}));
  EXPECT_THAT(run({"info", path("sheet/finish.ngc")}).out, HasSubstr("seal          holds"));
}

TEST_F(Nest, WhatIsMissingOrDoesNotFitIsRefusedInOneLine) {
  expect_refusal(run({"nest", path("bee"), "--out", path("sheet")}), 2, {"--blank: is required"});
  expect_refusal(run({"nest", "--out", path("sheet"), "--blank", "9,9"}), 2, {"DIR: is required"});
  expect_refusal(nest({"--blank", "9"}), 2, {"--blank"});
  expect_refusal(nest({"--blank", "20,20"}), 2, {"--blank 20 x 20 mm", "works"});
  expect_refusal(nest({"--blank", "400,200", "--gap", "0.5"}), 2, {"--gap 0.5", "at least"});
  expect_refusal(run({"nest", path("none"), "--out", path("sheet"), "--blank", "99,99"}), 2,
                 {path("none")});
  expect_refusal(run({"nest", path("bee"), "--out", path("disc"), "--blank", "400,200"}), 2,
                 {"is a lens folder"});
  EXPECT_FALSE(fs::exists(at("sheet")));
}

}  // namespace
}  // namespace lensforge::scenario
