// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <regex>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

/// Designs that ask for more than light can be bent.
class DesignReach : public Scenario {
 protected:
  [[nodiscard]] Outcome design(const Arguments& extra) const {
    Arguments arguments = small_design(picture("portrait.png"), path("lens"));
    arguments.emplace_back("--quiet");
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    return run(arguments);
  }

  /// Refused with a focal length that works, and that one does.
  void expect_advice_works(Arguments options) const {
    const Outcome refused = design(options);
    expect_refusal(refused, 2, {"--focal", "works"});
    EXPECT_FALSE(fs::exists(at("lens"))) << "a checkpoint would refuse the corrected command";
    std::smatch advice;
    const std::regex form("--focal ([0-9.e+]+mm) works");
    ASSERT_TRUE(std::regex_search(refused.err, advice, form)) << refused.err;
    options.insert(options.end(), {"--focal", advice[1].str()});
    if (options.front() == "--focal") options.erase(options.begin(), options.begin() + 2);
    EXPECT_EQ(design(options).exit_code, 0) << advice[1].str();
    fs::remove_all(at("lens"));
  }
};

TEST_F(DesignReach, AFocalLengthThatIsTooShortIsToldWithOneThatDoes) {
  for (const char* focal : {"20", "7"}) expect_advice_works({"--focal", focal});
}

TEST_F(DesignReach, NothingIsSaidOfADesignThatIsRefused) {
  Arguments arguments = small_design(picture("portrait.png"), path("lens"));
  arguments.insert(arguments.end(), {"--resume", "--focal", "7"});
  const Outcome refused = run(arguments);
  expect_refusal(refused, 2, {"--focal", "works"});
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
}

TEST_F(DesignReach, AWideLensOrAWeakIndexNeedsMoreDistance) {
  expect_advice_works({"--width", "1000"});
  expect_advice_works({"--ior", "1.02"});
}

TEST_F(DesignReach, AFinerLevelStartsFromAMeshWithoutFolds) {
  const Outcome made = run({"design", picture("rings.png"), "--out", path("lens"), "--pixels", "48",
                            "--levels", "2", "--rounds", "2", "--quality", "draft", "--width",
                            "12mm", "--focal", "36mm", "--model", "smooth", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  // It ends at 0.0020, over one level alone at 0.0013.
  EXPECT_LT(made.json()["metrics"]["smooth"]["mae"].get<double>(), 0.003);
}

TEST_F(DesignReach, AFirstSurfaceThatSendsLightPastTheScreenIsRefused) {
  const auto tilted = [&](const char* tilt) {
    return design({"--width", "12mm", "--source", "point", "--source-position", "21,19,-8",
                   "--transport-rounds", "0", "--screen-tilt", tilt});
  };
  expect_refusal(tilted("34,-13"), 2, {"--screen-tilt 34,-13: ", "--screen-tilt 0,0 works"});
  EXPECT_FALSE(fs::exists(at("lens"))) << "a checkpoint would refuse the corrected command";
  EXPECT_EQ(tilted("0,0").exit_code, 0);
}

TEST_F(DesignReach, SizesBeyondAllMeasureAreRefusedByTheirRange) {
  for (const Arguments& options :
       {Arguments{"--width", "1e308"}, Arguments{"--width", "1e-300"}, Arguments{"--ior", "1e308"},
        Arguments{"--ior", "1.0000000001"}, Arguments{"--focal", "1e300"},
        Arguments{"--thickness", "1e-300"}, Arguments{"--weight-image", "1e308"}}) {
    expect_refusal(design(options), 2, {options[0] + " " + options[1] + ": must be"});
  }
}

TEST_F(DesignReach, TheEndsOfTheRangesAreDesigned) {
  for (const Arguments& options :
       {Arguments{"--width", "0.01", "--thickness", "0.001"}, Arguments{"--ior", "10"},
        Arguments{"--width", "100m", "--focal", "1000m"}, Arguments{"--focal", "10000m"}}) {
    EXPECT_EQ(design(options).exit_code, 0) << options[0] << " " << options[1];
    fs::remove_all(at("lens"));
  }
}

}  // namespace
}  // namespace lensforge::scenario
