// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "cam/cam_meshes.h"
#include "cam/plan/finishing.h"
#include "cam/small_cuts.h"
#include "core/temp_folder.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

using lensforge::testing::TempFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kSlope = 0.5;
constexpr double kScallop = 0.002;

/// A ball of 0.4 mm leaves that scallop on a plane.
const double kOnPlane = 2.0 * std::sqrt(kScallop * (0.4 - kScallop));

/// A lens that rises across the rows, and the picture where its light lands.
Lens wedge() {
  Lens lens = testing::small_lens();
  lens.setup.image_origin = {0.0, 1.5};
  lens.surface =
      testing::grid_mesh(21, 17, 3.0, 2.0, [](double, double y) { return 6.0 + kSlope * y; });
  return lens;
}

CamOptions finishing(double scallop) {
  CamOptions options;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.workshop.process.finish.scallop = scallop;
  options.workshop.polish.sigma = 0.02;
  options.remedies = false;
  return options;
}

std::string parameter(const ReportData& report, const std::string& name) {
  for (const ParameterGroup& group : report.parameters) {
    for (const NamedText& one : group.parameters) {
      if (one.name == name) return one.value;
    }
  }
  return "";
}

TEST(FinishPitch, IsTheSameInProgramsReportAndSamples) {
  const TempFolder folder;
  const ReportData report = testing::run_cut(wedge(), finishing(kScallop), folder).report;
  const double cut = report.operations.at(0).summary.stepover;
  const double rows = std::ceil(2.0 * std::hypot(1.0, kSlope) / kOnPlane);
  EXPECT_NEAR(cut, 2.0 / rows, 1e-12);
  EXPECT_EQ(parameter(report, "Stepover"), decimal_text(cut, 4) + " mm");
  EXPECT_THAT(parameter(report, "Sampled every"), HasSubstr(decimal_text(cut / 6.1, 4) + " mm"));
}

/// Two balls blend on the rows that the programs have.
TEST(FinishPitch, OfAScallopMakesTheBallsOfAnEqualStatedOne) {
  CamOptions one = finishing(kScallop);
  one.workshop.process.finish.large_tool = 4;
  CamOptions other = one;
  const FinishGround ground{{Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(9.0, 9.0)}, kSlope, 0.0};
  other.workshop.process.finish.set_pitch(finish_pitch(one, ground));
  EXPECT_TRUE(same_balls(one, other, ground));
  FinishGround level = ground;
  level.steepest = 0.0;
  EXPECT_FALSE(same_balls(one, other, level));
}

/// For estimates.
TEST(FinishPitch, OfAnUnknownSurfaceIsThatOfALevelOneOfTheLensesSize) {
  const CamOptions options = finishing(kScallop);
  const double planned = finish_pitch(options, unknown_ground(options, wedge().setup));
  EXPECT_NEAR(planned, 2.0 / std::ceil(2.0 / kOnPlane), 1e-12);
  EXPECT_EQ(passes_on_lens(options, unknown_ground(options, wedge().setup)).pitch, planned);
}

/// Made for the pitch that a design assumes, which knows no slopes.
std::vector<std::string> warnings_of(Lens lens, CamOptions options, double designed) {
  const TempFolder folder;
  options.render = false;
  lens.provenance =
      nlohmann::json{{"made_by", {{"pitch_mm", designed}, {"polish_sigma_mm", 0.02}}}};
  std::vector<std::string> warnings = testing::run_cut(lens, options, folder).report.warnings;
  std::erase_if(warnings, [](const std::string& text) {
    return text.find("was designed for") == std::string::npos;
  });
  return warnings;
}

TEST(FinishPitch, OtherThanDesignedForIsWarnedOf) {
  EXPECT_THAT(
      warnings_of(wedge(), finishing(kScallop), kOnPlane),
      ElementsAre("the lens was designed for a pitch of 0.0564 mm and a polish of σ 0.02 mm, "
                  "not 0.0505 and 0.02 mm: cut it with --pitch 0.0564mm"));
  CamOptions as_designed = finishing(0.0);
  as_designed.workshop.process.finish.set_pitch(0.0564);
  EXPECT_THAT(warnings_of(wedge(), as_designed, kOnPlane), IsEmpty());
  EXPECT_THAT(warnings_of(testing::small_lens(), finishing(0.0), 0.045),
              ElementsAre(HasSubstr("or design it for this workshop")));
}

}  // namespace
}  // namespace lensforge
